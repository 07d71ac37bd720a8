//! Two constraint types that Cutis does not have, as another crate adds them: a Rust file, a WGSL file and a line of
//! `conformance!` each, and no file of Cutis touched.
//!
//! | constraint | vertices | `C` |
//! |---|---|---|
//! | [`DihedralBending`] | 4 | `2 sin(θ/2) − 2 sin(θ₀/2)` of the angle between two triangles |
//! | [`FibreStretch`] | 4 | `|F a| − s` of a tetrahedron along a fibre |
#![forbid(unsafe_code)]

mod dihedral_bending;
mod fibre_stretch;

pub use dihedral_bending::DihedralBending;
pub use fibre_stretch::{Fibre, FibreStretch};

#[cfg(doctest)]
#[doc = include_str!("../../../docs/book/adding-a-constraint.md")]
struct Page;
