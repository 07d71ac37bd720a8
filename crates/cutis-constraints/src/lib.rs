//! Position-based constraints: their values and gradients.
//!
//! A [`Constraint`] supplies a value `C(x)` and its gradient `∇C(x)`. Mass, compliance, multiplier
//! and time step belong to the solver and never appear here.
//!
//! | constraint | vertices | `C` | compliance |
//! |---|---|---|---|
//! | [`Distance`] | 2 | length − rest length, m | [`distance_compliance`], m/N |
//! | [`Volume`] | 4 | signed volume − rest volume, m³ | [`volume_compliance`], m³/Pa |
//! | [`SkinTension`] | 3 | (area − rest area) · `q`, m² | [`skin_compliance`], m³/N |
//! | [`SkinTensionPaper`] | 3 | (area − rest area) · `F`, m²; PBD only | none, but a stiffness from 0 to 1 |
//! | [`SkinStrip`] | 3 | (length of the image of a direction − rest length) · `q`, m | [`skin_strip_compliance`], m/N |
//! | [`SkinStripAtRest`] | 3 | the same for a body at rest in the scan, m | as above |
//! | [`SkinStripTurn`] | 3 | turn of the image against a constant load, m | as above |
//! | [`Thread`] | 6 | distance of two points of triangles beyond a length, m | 1/stiffness, m/N |
//! | [`LipContact`] | 4 | overlap of the sides of a cut over the length of a severed edge, 1 | [`lip_contact_compliance`], 1/J |
//! | [`LipAdhesion`] | 4 | gap between the sides of a cut over the length of a severed edge, 1 | as above |
//!
//! Each formula is written once and runs as `f32`, as `f64` and in SIMD lanes of both ([`Real`]).
//! Every lane has the bits of a scalar evaluation, for any width of the registers
//! ([`SimdLevel`]). No formula contains an absolute length or an
//! absolute epsilon, so scaling a body by 1e-3 or 1e3 scales the results. The only limit is the
//! exponent range of the number type: in `f32`, elements between about 1e-7 m and 1e7 m neither
//! underflow nor overflow.
//!
//! ```
//! use cutis_constraints::{Constraint, Distance, DistanceMaterial};
//! use nalgebra::{Point3, Vector3};
//!
//! let rest = [Point3::new(0.0, 0.0, 0.0), Point3::new(0.002, 0.0, 0.0)];
//! let params = Distance::from_rest(&rest, &DistanceMaterial::default());
//! let stretched = [rest[0], Point3::new(0.003, 0.0, 0.0)];
//! let eval = Distance::eval(&stretched, &params);
//! assert!((eval.c - 0.001f64).abs() < 1e-15);
//! assert_eq!(eval.grad, [-Vector3::x(), Vector3::x()]);
//! ```
#![deny(unsafe_code)]

mod constraint;
mod distance;
mod lanes;
mod lip_adhesion;
mod lip_contact;
mod material;
mod prefetch;
mod real;
mod skin_strip;
mod skin_strip_at_rest;
mod skin_strip_turn;
mod skin_tension;
mod skin_tension_paper;
mod strip;
mod strip_material;
mod thread;
mod triangle;
mod volume;

pub use constraint::{Constraint, Eval, Params, UnitGradients};
pub use distance::{Distance, DistanceMaterial};
pub use lanes::{LaneTask, Lanes, SimdLevel};
pub use lip_adhesion::LipAdhesion;
pub use lip_contact::{LipContact, LipContactMaterial};
pub use material::{
    MaterialError, distance_compliance, lip_contact_compliance, skin_compliance, skin_strip_compliance,
    volume_compliance,
};
pub use prefetch::prefetch;
pub use real::{Real, Scalar, cross};
pub use skin_strip::SkinStrip;
pub use skin_strip_at_rest::SkinStripAtRest;
pub use skin_strip_turn::SkinStripTurn;
pub use skin_tension::{SkinTension, SkinTensionMaterial};
pub use skin_tension_paper::{SkinTensionPaper, SkinTensionPaperMaterial};
pub use strip_material::{SkinStripLaw, SkinStripMaterial, SkinStripShape};
pub use thread::{Thread, ThreadMaterial};
pub use volume::{Volume, VolumeMaterial};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
