//! Two constraint types that Cutis does not have, as an external crate adds them. Each needs a Rust
//! file, a WGSL file and a line of `conformance!`, and no change in Cutis.
//!
//! | constraint | vertices | `C` |
//! |---|---|---|
//! | [`DihedralBending`] | 4 | `2 sin(θ/2) − 2 sin(θ₀/2)` of the angle between two triangles |
//! | [`FiberStretch`] | 4 | `|F a| − s` of a tetrahedron along a fiber |
#![forbid(unsafe_code)]

mod dihedral_bending;
mod fiber_stretch;

pub use dihedral_bending::DihedralBending;
pub use fiber_stretch::{Fiber, FiberStretch};

#[cfg(doctest)]
#[doc = include_str!("../../../docs/book/adding-a-constraint.md")]
struct Page;
