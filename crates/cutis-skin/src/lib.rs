//! Fields on the skin of a lattice body: smooth normals, directions of tension, and depth below the
//! skin.
#![doc = ""]
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod body_skin;
mod depth;
mod directions;
mod error;
mod field;
mod nearest;
mod normals;
mod strokes;
mod vertices;

pub use body_skin::BodySkin;
pub use depth::depth_mm;
pub use directions::{Directions, TangentField};
pub use error::SkinError;
pub use field::{CellData, SkinField};
pub use normals::Normals;
pub use strokes::{Place, Polyline, Strokes};
