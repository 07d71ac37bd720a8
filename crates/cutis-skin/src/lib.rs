//! Fields on the skin of a lattice body: smooth normals, directions of tension, depth below the
//! skin, and moves onto a smooth surface.
#![doc = ""]
#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod around;
mod blur;
mod body_skin;
mod depth;
mod directions;
mod error;
mod field;
mod nearest;
mod normals;
mod skin_moves;
mod strokes;
mod vertices;

pub use body_skin::BodySkin;
pub use depth::depth_mm;
pub use directions::{Directions, TangentField};
pub use error::SkinError;
pub use field::{CellData, SkinField};
pub use normals::Normals;
pub use skin_moves::SkinMoves;
pub use strokes::{DrawnPairs, DrawnPath, Place, Polyline, Strokes};
