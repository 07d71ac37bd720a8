//! P8: a beam that is held at one end and bends under its own weight, with the answer of an independent FEM.
//!
//! A square beam of tissue, four times as long as thick, on a `kuhn6` lattice of `cutis-mesh`, along x; gravity along −y. Where
//! it comes to rest is a minimum of an energy, so that Newton's method (`cutis-newton`), finite elements (`tests/python`) and
//! the solver with short substeps have to agree; with the few substeps of real time it need not, and [`Document`] says by
//! how much.

mod beam;
mod cases;
mod document;
mod settle;

pub use beam::{Beam, Failure, GRAVITY_M_S2, Material};
pub use cases::{Case, real_time};
pub use document::{Document, Options};
pub use settle::{Rest, Way, converged, settle};
