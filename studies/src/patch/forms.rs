//! Forms of skin tension on the triangles of a staircase, with the tension and the modulus that
//! each should have in the plane.

use cutis::constraints::{Constraint, SkinStrip, SkinStripLaw, SkinStripMaterial};
use cutis::constraints::{SkinTension, SkinTensionMaterial};
use cutis_test_kit::Random;
use nalgebra::{Point3, Vector3};

use super::skin::{PlaneSkin, area_vector, direction};

type Triangle = [Point3<f64>; 3];

/// A form of skin tension.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Form {
    /// The area of each triangle, with equal moduli (`skin_tension` of scenes).
    Area,
    /// The area, with moduli times `A_p/A`: the part of each triangle that is seen along the
    /// normal.
    AreaBySight,
    /// The area, with moduli times `2c/(1 + c²)` for `c = A_p/A`, which gives the mean of the two
    /// tensions its right value.
    AreaByMean,
    /// The area of the projection on the plane.
    ProjectedArea,
    /// Strips along and across.
    Strips,
    /// Strips that measure the image of the sloped triangle: a control.
    StripsSloped,
    /// Strips with normals that are tilted by 10° in random directions.
    StripsTilted,
    /// Strips along and across exchanged: a control.
    StripsExchanged,
}

/// Tension along and across in N/m, of the trunk's order of magnitude. The area forms have the
/// first in all directions.
const TENSION: [f64; 2] = [15.0, 5.0];
/// Modulus along and across in N/m.
const MODULUS: [f64; 2] = [60.0, 40.0];
/// Angle in rad by which normals are tilted.
const TILT: f64 = 10.0 * std::f64::consts::PI / 180.0;

impl Form {
    /// All forms in the order of the table.
    pub const ALL: [Self; 8] = [
        Self::Area,
        Self::AreaBySight,
        Self::AreaByMean,
        Self::ProjectedArea,
        Self::Strips,
        Self::StripsSloped,
        Self::StripsTilted,
        Self::StripsExchanged,
    ];

    /// Name in the table.
    pub fn name(self) -> &'static str {
        match self {
            Self::Area => "area",
            Self::AreaBySight => "area, weighted by `A_p/A`",
            Self::AreaByMean => "area, weighted by `2c/(1 + c²)`",
            Self::ProjectedArea => "area of the projection",
            Self::Strips => "strips",
            Self::StripsSloped => "control: strips with the slope",
            Self::StripsTilted => "strips, normals off by 10°",
            Self::StripsExchanged => "control: strips exchanged",
        }
    }

    fn is_strips(self) -> bool {
        !matches!(self, Self::Area | Self::AreaBySight | Self::AreaByMean | Self::ProjectedArea)
    }

    /// The tensions along and across that the form should have, in N/m.
    pub fn tension(self) -> [f64; 2] {
        if self.is_strips() { TENSION } else { [TENSION[0]; 2] }
    }

    /// The growth of the tension along and across per strain in the same direction, on a flat skin,
    /// in N/m.
    pub fn modulus(self) -> [f64; 2] {
        if self.is_strips() { MODULUS } else { [MODULUS[0]; 2] }
    }

    /// The constraints on the triangles of a skin.
    pub fn pieces(self, skin: &PlaneSkin) -> Vec<Piece> {
        let mut random = Random::new(17);
        let pieces = skin.triangles.iter().zip(&skin.weights).map(|(x, &weight)| {
            let facing = area_vector(x).dot(&skin.normal);
            let c = facing / area_vector(x).norm();
            let kinds = match self {
                Self::Area => vec![area(x, 1.0)],
                Self::AreaBySight => vec![area(x, c)],
                Self::AreaByMean => vec![area(x, 2.0 * c / (1.0 + c * c))],
                Self::ProjectedArea => vec![projected(facing, skin.normal)],
                Self::Strips => strips(x, skin.normal, [skin.along, skin.across()], false),
                Self::StripsSloped => strips(x, skin.normal, [skin.along, skin.across()], true),
                Self::StripsTilted => {
                    let tilted =
                        skin.normal + direction(&mut random).cross(&skin.normal).normalize() * TILT.tan();
                    strips(x, tilted, [skin.along, skin.across()], false)
                }
                Self::StripsExchanged => strips(x, skin.normal, [skin.across(), skin.along], false),
            };
            Piece { x: *x, weight, kinds }
        });
        pieces.collect()
    }
}

/// The constraints on one triangle, with its shape in the scan and its weight in the window.
pub struct Piece {
    x: Triangle,
    weight: f64,
    kinds: Vec<Kind>,
}

/// A constraint with its compliance.
enum Kind {
    Area { params: [f64; 2], compliance: f64 },
    ProjectedArea { rest_area: f64, normal: Vector3<f64>, compliance: f64 },
    Strip { params: [f64; 9], compliance: f64 },
}

impl Piece {
    /// `Σ −f_i·a X_i·b` in N·m after the map `x → x + strain·u (u·x)`, times the weight: the share
    /// of the triangle in the nominal tension.
    pub fn virial(&self, a: &Vector3<f64>, b: &Vector3<f64>, u: &Vector3<f64>, strain: f64) -> f64 {
        let moved = self.x.map(|p| p + u * (strain * p.coords.dot(u)));
        let forces = self.kinds.iter().map(|kind| kind.pull(&moved));
        let sum = |pull: [Vector3<f64>; 3]| -> f64 {
            (0..3).map(|i| pull[i].dot(a) * (self.x[i] - self.x[0]).dot(b)).sum()
        };
        self.weight * forces.map(sum).sum::<f64>()
    }
}

impl Kind {
    /// `(C/α) ∇C` at the vertices, in N.
    fn pull(&self, x: &Triangle) -> [Vector3<f64>; 3] {
        match self {
            Self::Area { params, compliance } => {
                let eval = SkinTension::eval(x, params);
                eval.grad.map(|g| g * (eval.c / compliance))
            }
            Self::Strip { params, compliance } => {
                let eval = SkinStrip::eval(x, params);
                eval.grad.map(|g| g * (eval.c / compliance))
            }
            Self::ProjectedArea { rest_area, normal, compliance } => {
                let c = area_vector(x).dot(normal) - rest_area;
                let edges = [x[2] - x[1], x[0] - x[2], x[1] - x[0]];
                edges.map(|edge| normal.cross(&edge) * (0.5 * c / compliance))
            }
        }
    }
}

/// Rest area over area of the area forms: the tension is `T(1 − s)/s` and the modulus `T/s`.
const REST_SCALE: f64 = 1.0 - TENSION[0] / MODULUS[0];

fn area(x: &Triangle, weight: f64) -> Kind {
    let material = SkinTensionMaterial { rest_area_scale: REST_SCALE, amplification: 0.0 };
    let params: [f64; 2] = SkinTension::from_rest(x, &material);
    Kind::Area { params, compliance: params[0] / (REST_SCALE * MODULUS[0] * weight) }
}

fn projected(facing: f64, normal: Vector3<f64>) -> Kind {
    let rest_area = REST_SCALE * facing;
    Kind::ProjectedArea { rest_area, normal, compliance: facing / MODULUS[0] }
}

/// Two strips, less those across which the triangle has no extent.
fn strips(x: &Triangle, normal: Vector3<f64>, directions: [Vector3<f64>; 2], sloped: bool) -> Vec<Kind> {
    let strip = |k: usize| {
        let law = SkinStripLaw {
            tension_n_per_m: TENSION[k],
            modulus_n_per_m: MODULUS[k],
            stiffening: 0.0,
            compression: 1.0,
        };
        let material = SkinStripMaterial::new(normal.into(), directions[k].into(), law).ok()?;
        let mut params: [f64; 9] = SkinStrip::from_rest(x, &material);
        let compliance = material.compliance(x).ok()?;
        if sloped {
            let [.., x, y, z] = params;
            let grown = (params[3].powi(2) + x * x + y * y + z * z).sqrt() / params[3];
            // The rest length and the scan's length grow with the image.
            params = [params[0], params[1], params[2] * grown, params[3] * grown, 0.0, 1.0, 0.0, 0.0, 0.0];
        }
        Some(Kind::Strip { params, compliance })
    };
    (0..2).filter_map(strip).collect()
}
