//! A flat sheet of skin strips with an elliptical hole. How far the hole opens is known in closed
//! form.
//!
//! The sheet is a triangulated disc. Its vertices lie on confocal ellipses, from the hole to an
//! almost round border. They come from the conformal map `z = ρ e^{iη} + c²/(4ρ) e^{−iη}`, so the
//! triangles have good shapes and become small at the tips of a slit.

use std::f64::consts::{PI, TAU};

use cutis::constraints::{
    Constraint, Distance, SkinStrip, SkinStripAtRest, SkinStripLaw, SkinStripMaterial, SkinStripTurn,
};
use cutis_coloring::greedy;
use cutis_newton::{Options, Problem};
use cutis_solver::{Stiffness, SystemBuilder, Values};
use nalgebra::{Point3, Vector3};

use crate::kit::Failure;

/// Half-length of the hole in m.
pub const HALF_LENGTH: f64 = 0.02;
/// Half-width over half-length of a slit.
const SLENDER: f64 = 1e-3;

/// Length in m and stiffness in N/m of the springs that keep the sheet flat. Compressed skin would
/// buckle. The springs are perpendicular to the sheet, so they resist motions in its plane only to
/// the third order.
const GUIDE: (f64, f64) = (1.0, 1.0);

/// A hole in the middle of the sheet, with its long side along x.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Hole {
    /// An ellipse of a thousandth of its length.
    Slit,
    /// A circle.
    Round,
}

/// Skin of three families of strips, at 0°, 60° and 120° to the lines of tension.
///
/// With equal moduli `T` the skin is isotropic, with `E′ = T` and `ν = 1/3`: `C11 = 9/8 T` and
/// `C12 = C66 = 3/8 T`.
#[derive(Clone, Copy, Debug)]
pub struct Skin {
    /// Tension along and across the lines in N/m. The tension along them is at least a third of
    /// the tension across.
    pub tension: [f64; 2],
    /// Modulus of the family along the lines, and of the other two, in N/m.
    pub modulus: [f64; 2],
    /// Angle of the lines to the long side of the hole, in degrees.
    pub angle_deg: f64,
}

impl Skin {
    /// Poisson's ratio for equal moduli.
    pub const POISSON: f64 = 1.0 / 3.0;

    fn strips(&self) -> Result<[SkinStripMaterial; 3], Failure> {
        let ([n1, n2], [t1, t2]) = (self.tension, self.modulus);
        let family = |turn_deg: f64, tension_n_per_m: f64, modulus_n_per_m: f64| {
            let (sin, cos) = (self.angle_deg + turn_deg).to_radians().sin_cos();
            let law = SkinStripLaw { tension_n_per_m, modulus_n_per_m, stiffening: 0.0, compression: 1.0 };
            SkinStripMaterial::new([0.0, 0.0, 1.0], [cos, sin, 0.0], law)
        };
        let side = 2.0 * n2 / 3.0;
        Ok([family(0.0, n1 - n2 / 3.0, t1)?, family(60.0, side, t2)?, family(120.0, side, t2)?])
    }

    /// `E′` in N/m of a slit along x: a tension `σ` across the slit opens it by `4aσ/E′` in the
    /// middle. The lines must be along or across the slit unless the moduli are equal.
    ///
    /// Source: Sih, Paris, Irwin 1965, International Journal of Fracture Mechanics 1, 189.
    pub fn modulus_across_slit(&self) -> f64 {
        let [t1, t2] = self.modulus;
        let (c11, c22, c12) = (t1 + t2 / 8.0, 9.0 / 8.0 * t2, 3.0 / 8.0 * t2);
        let determinant = c11 * c22 - c12 * c12;
        let (along, across) = (c22 / determinant, c11 / determinant);
        let (s12, s66) = (-c12 / determinant, 1.0 / c12);
        let lies_across = (self.angle_deg / 90.0).round().rem_euclid(2.0) == 1.0;
        let (s11, s22) = if lies_across { (across, along) } else { (along, across) };
        let mix = (s22 / s11).sqrt() + (2.0 * s12 + s66) / (2.0 * s11);
        1.0 / ((s11 * s22 / 2.0).sqrt() * mix.sqrt())
    }

    /// Opening of a slit in its middle, in m: `4a(N1 sin²θ + N2 cos²θ)/E′`.
    pub fn slit_opening(&self) -> f64 {
        let ([n1, n2], (sin, cos)) = (self.tension, self.angle_deg.to_radians().sin_cos());
        4.0 * HALF_LENGTH * (n1 * sin * sin + n2 * cos * cos) / self.modulus_across_slit()
    }

    /// Displacement of the edge of a round hole along the lines and across them, in m:
    /// `a(2N1 − (1 − ν)N2)/E′`, and the same with 1 and 2 exchanged. The moduli must be equal.
    ///
    /// It is Kirsch's displacement `a(3N1 − N2)/E′` minus that of the sheet without a hole,
    /// `a(N1 − νN2)/E′`, because the tension acts before the cut.
    pub fn hole_displacement(&self) -> [f64; 2] {
        let [n1, n2] = self.tension;
        let one = |n1: f64, n2: f64| HALF_LENGTH * (2.0 * n1 - (1.0 - Self::POISSON) * n2) / self.modulus[0];
        [one(n1, n2), one(n2, n1)]
    }
}

/// How the sheet holds its tension before the cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Held {
    /// The scan is at rest: each strip contains its own load, and the loads of the strips that the
    /// cut removes stay, times this factor. It is 1 except in controls.
    Scan(f64),
    /// Strips without loads. The border holds their tension.
    Border,
}

/// The uncut sheet.
pub struct HoledSheet {
    positions: Vec<Point3<f64>>,
    /// Triangles that stay.
    triangles: Vec<[u32; 3]>,
    /// Triangles that the cut removes.
    removed: Vec<[u32; 3]>,
    /// Vertices on each ellipse. The first ellipse is the edge of the hole.
    around: usize,
}

impl HoledSheet {
    /// A sheet with `around` vertices on the edge of the hole, and a border at `reach` times the
    /// half-length of the hole.
    pub fn new(hole: Hole, around: usize, reach: f64) -> Self {
        let a = HALF_LENGTH;
        let b = if hole == Hole::Round { a } else { a * SLENDER };
        let (first, focus) = (0.5 * (a + b), 0.25 * (a * a - b * b));
        // Neighboring ellipses are turned by half a step, so that triangles are about equilateral.
        let growth = (3f64.sqrt() * PI / around as f64).exp();
        let ellipses = ((reach * a / first).ln() / growth.ln()).ceil() as usize + 1;
        let mut positions = Vec::with_capacity(ellipses * around + 1);
        for k in 0..ellipses {
            let rho = first * growth.powi(k as i32);
            let (wide, high) = (rho + focus / rho, rho - focus / rho);
            for j in 0..around {
                let (sin, cos) = (TAU * (j as f64 + 0.5 * (k % 2) as f64) / around as f64).sin_cos();
                positions.push(Point3::new(wide * cos, high * sin, 0.0));
            }
        }
        let middle = positions.len() as u32;
        positions.push(Point3::origin());
        let vertex = |k: usize, j: usize| (k * around + j % around) as u32;
        let mut triangles = Vec::with_capacity(2 * ellipses * around);
        for k in 0..ellipses - 1 {
            for j in 0..around {
                let next = j + k % 2;
                triangles.push([vertex(k, j), vertex(k + 1, next), vertex(k, j + 1)]);
                triangles.push([vertex(k, j + 1), vertex(k + 1, next), vertex(k + 1, next + 1)]);
            }
        }
        let removed = (0..around).map(|j| [middle, vertex(0, j), vertex(0, j + 1)]).collect();
        Self { positions, triangles, removed, around }
    }

    /// Number of vertices.
    pub fn vertices(&self) -> usize {
        self.positions.len()
    }

    /// Cuts the hole and finds the equilibrium. Returns the displacement of each vertex of the
    /// hole's edge in m. Vertex `j` of `n` is at the angle `2πj/n` of the ellipse.
    ///
    /// # Errors
    /// A material is refused, or there is no equilibrium.
    pub fn cut(&self, skin: &Skin, held: Held) -> Result<Vec<Vector3<f64>>, Failure> {
        let materials = skin.strips()?;
        let (count, (length, stiffness)) = (self.positions.len(), GUIDE);
        let free = count - 1 - self.around;
        let mut positions = self.positions.clone();
        positions.extend(self.positions.iter().map(|x| x + Vector3::z() * length));
        let masses = (0..2 * count).map(|v| if v < free { 1.0 } else { 0.0 });
        let guides: Vec<[u32; 2]> = (0..free as u32).map(|v| [v, v + count as u32]).collect();
        let builder = SystemBuilder::<f64>::new(&positions, &masses.collect::<Vec<_>>())?
            .add::<Distance, 2>(
                &guides,
                &vec![[length]; free],
                Stiffness::compliance(1.0 / stiffness),
                &greedy(&guides, positions.len())?,
            )?;
        let builder = match held {
            Held::Scan(factor) => {
                let builder = self.add::<SkinStripAtRest>(builder, &materials)?;
                let builder = self.add::<SkinStripTurn>(builder, &materials)?;
                builder.loads(&self.freed_loads(&materials, factor)?)?
            }
            Held::Border => self.add::<SkinStrip>(builder, &materials)?,
        };
        let problem = Problem::of(&builder.build(), [0.0; 3])?;
        let found = problem.equilibrium(problem.positions(), &Options::default())?;
        let edge = 0..self.around;
        Ok(edge.map(|v| found.positions[v] - self.positions[v]).collect())
    }

    fn at_rest(&self, triangle: &[u32; 3]) -> [Point3<f64>; 3] {
        triangle.map(|v| self.positions[v as usize])
    }

    /// Adds a kind of strip on the triangles that stay.
    fn add<C: Constraint<3, Material = SkinStripMaterial>>(
        &self,
        builder: SystemBuilder<f64>,
        materials: &[SkinStripMaterial; 3],
    ) -> Result<SystemBuilder<f64>, Failure> {
        let (mut vertices, mut params, mut compliances) = (Vec::new(), Vec::new(), Vec::new());
        for triangle in &self.triangles {
            let x = self.at_rest(triangle);
            for material in materials {
                vertices.push(*triangle);
                params.push(C::from_rest(&x, material));
                compliances.push(material.compliance(&x)?);
            }
        }
        let stiffness = Stiffness::Compliance(Values::Each(compliances));
        let groups = greedy(&vertices, 2 * self.positions.len())?;
        Ok(builder.add::<C, 3>(&vertices, &params, stiffness, &groups)?)
    }

    /// The loads in N that held the removed strips before the cut: the negative of their forces,
    /// times a factor.
    fn freed_loads(
        &self,
        materials: &[SkinStripMaterial; 3],
        factor: f64,
    ) -> Result<Vec<Vector3<f64>>, Failure> {
        let mut loads = vec![Vector3::zeros(); 2 * self.positions.len()];
        for triangle in &self.removed {
            let x = self.at_rest(triangle);
            for material in materials {
                let eval = SkinStrip::eval(&x, &SkinStrip::from_rest(&x, material));
                let strength = factor * eval.c / material.compliance(&x)?;
                for (&v, gradient) in triangle.iter().zip(eval.grad) {
                    loads[v as usize] += gradient * strength;
                }
            }
        }
        Ok(loads)
    }
}
