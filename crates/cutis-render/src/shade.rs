//! Color of a surface point: skin or, where it was deep at rest, tissue by HU; with light and
//! ambient occlusion.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::blocks::{Block, Blocks};
use crate::field::Field;
use crate::image::to_byte;
use crate::raymarch::Hit;
use crate::{Axes, Rgb, View};

/// Color behind the body.
pub const BACKGROUND: Rgb = [24, 26, 32];
pub const SKIN: Rgb = [232, 186, 160];
/// Colors of the tissue in a wound by HU: fat, connective tissue, muscle, bone.
pub const TISSUE: [(f32, Rgb); 6] = [
    (-180.0, [250, 206, 124]),
    (-70.0, [242, 178, 100]),
    (-20.0, [214, 92, 74]),
    (60.0, [168, 38, 34]),
    (160.0, [190, 90, 74]),
    (400.0, [238, 228, 206]),
];
/// Number of directions of the ambient occlusion, spread over a sphere.
pub const DIRECTIONS: usize = 16;
/// Fractions of the occlusion's reach that are probed for tissue.
const REACHES: [f64; 3] = [0.2, 0.5, 1.0];

/// Linear light, 0 to 1.
pub type Light = Vector3<f32>;

/// Computes surface colors of one field for one view.
pub struct Shader<'a> {
    field: &'a Field<'a>,
    depth: Option<(Field<'a>, f64)>,
    threshold_hu: f32,
    pub skin_mm: f64,
    pub occlusion_mm: f64,
    pub directions: [Vector3<f64>; DIRECTIONS],
    /// Index offsets of the probes in each direction.
    probes: [[Vector3<f64>; REACHES.len()]; DIRECTIONS],
    pub index_per_mm: Matrix3<f64>,
    pub finest_mm: f64,
    pub toward: Vector3<f64>,
    pub light: Vector3<f64>,
}

impl<'a> Shader<'a> {
    pub fn new(field: &'a Field<'a>, view: &View<'a>, axes: &Axes) -> Self {
        let depth = view.depth.map(|volume| {
            let depth = Field::new(volume);
            let spacing = depth.finest_mm();
            (depth, spacing)
        });
        // Points of a Fibonacci spiral: they represent equal areas, and no two are on one meridian.
        let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let directions = std::array::from_fn(|n| {
            let z = 1.0 - (2 * n + 1) as f64 / DIRECTIONS as f64;
            let (sin, cos) = (golden * n as f64).sin_cos();
            let radius = (1.0 - z * z).sqrt();
            Vector3::new(radius * cos, radius * sin, z)
        });
        let index_per_mm = field.index_per_mm();
        let probes = directions.map(|direction: Vector3<f64>| {
            REACHES.map(|part| index_per_mm * direction * (part * view.occlusion_mm))
        });
        // Depths are uncertain by a voxel.
        let skin_mm = depth.as_ref().map_or(view.skin_mm, |(_, spacing)| view.skin_mm.max(*spacing));
        Self {
            field,
            depth,
            threshold_hu: view.threshold_hu,
            skin_mm,
            occlusion_mm: view.occlusion_mm,
            directions,
            probes,
            index_per_mm,
            finest_mm: field.finest_mm(),
            toward: axes.toward,
            light: (axes.toward * 0.75 + axes.up * 0.55 - axes.right * 0.4).normalize(),
        }
    }

    pub fn color(&self, hit: &Hit, blocks: &Blocks) -> Light {
        if hit.on_cut {
            let gray = (self.field.at(hit.index) + 160.0) / 400.0;
            return Light::repeat(gray.clamp(0.0, 1.0).powi(2)) * 0.8;
        }
        let normal = self.normal(hit.index);
        let base = self.albedo(hit.index, &normal);
        let open = self.openness(hit.index, &normal, blocks);
        // Light that has passed through tissue is red. Darker places are therefore redder.
        let root = open.sqrt();
        let surface = base.component_mul(&Light::new(open, open * root, open * root * root.sqrt()));
        let diffuse = normal.dot(&self.light).max(0.0) as f32;
        let facing = normal.dot(&self.toward).max(0.0) as f32;
        let half = (self.light + self.toward).normalize();
        let gloss = (normal.dot(&half).max(0.0) as f32).powi(24) * 0.06 * open;
        surface * (0.16 + 0.64 * diffuse * (0.25 + 0.75 * open) + 0.24 * facing) + Light::repeat(gloss)
    }

    /// Outward unit normal in world space.
    pub fn normal(&self, index: Point3<f64>) -> Vector3<f64> {
        let gradient = -(self.index_per_mm.transpose() * self.field.index_gradient(index));
        gradient.try_normalize(0.0).unwrap_or(self.toward)
    }

    /// How much of the tissue below the skin shows: 0 is skin, 1 a surface that was deep at rest.
    pub fn exposure(&self, index: Point3<f64>, normal: &Vector3<f64>) -> f32 {
        let Some((depth, spacing)) = &self.depth else { return 0.0 };
        let surface = self.field.to_mm(index);
        let below = f64::from(depth.at_mm(surface - normal * *spacing)) - spacing;
        smooth_step((below / self.skin_mm - 1.0) as f32)
    }

    /// Color of the skin, or of the tissue where the surface was deep at rest.
    fn albedo(&self, index: Point3<f64>, normal: &Vector3<f64>) -> Light {
        let skin = decode(SKIN);
        let exposed = self.exposure(index, normal);
        if exposed == 0.0 {
            return skin;
        }
        let inward = self.index_per_mm * normal * -self.finest_mm;
        let hu = (1..=2).map(|n| self.field.at(index + inward * n as f64)).sum::<f32>() / 2.0;
        skin.lerp(&tissue(hu), exposed)
    }

    /// Fraction of the ambient light that reaches the point: 1 on a convex body, less in a cleft.
    fn openness(&self, index: Point3<f64>, normal: &Vector3<f64>, blocks: &Blocks) -> f32 {
        if self.occlusion_mm == 0.0 {
            return 1.0;
        }
        let start = index + self.index_per_mm * normal * self.finest_mm;
        let (mut lit, mut all) = (0.0, 0.0);
        for (direction, probes) in self.directions.iter().zip(&self.probes) {
            let cosine = direction.dot(normal);
            if cosine <= 0.0 {
                continue;
            }
            all += cosine;
            let is_free = |position| match blocks.at(position) {
                Block::Empty => true,
                Block::Mixed => self.field.at(position) < self.threshold_hu,
                Block::Full => false,
            };
            let free = probes.iter().take_while(|&probe| is_free(start + probe)).count();
            lit += cosine * free as f64 / REACHES.len() as f64;
        }
        if all > 0.0 { (lit / all) as f32 } else { 1.0 }
    }
}

/// Color of the tissue in a wound by its HU, as pictures show it: fat, connective tissue, muscle,
/// bone and what lies between them.
pub fn tissue_color(hu: f32) -> Rgb {
    encode(tissue(hu))
}

/// Color of tissue by HU.
fn tissue(hu: f32) -> Light {
    let after = TISSUE.partition_point(|(at, _)| *at < hu);
    match (TISSUE.get(after.wrapping_sub(1)), TISSUE.get(after)) {
        (Some((low, a)), Some((high, b))) => decode(*a).lerp(&decode(*b), (hu - low) / (high - low)),
        (Some((_, only)), None) | (None, Some((_, only))) => decode(*only),
        (None, None) => Light::zeros(),
    }
}

/// 0 for `x` ≤ 0, 1 for `x` ≥ 1, smooth in between.
fn smooth_step(x: f32) -> f32 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// Linear light of a stored color, with a gamma of 2.
pub fn decode(color: Rgb) -> Light {
    Light::from(color.map(|c| (f32::from(c) / 255.0).powi(2)))
}

/// Stored color of linear light.
pub fn encode(light: Light) -> Rgb {
    light.map(|c| to_byte(c.clamp(0.0, 1.0).sqrt() * 255.0)).into()
}
