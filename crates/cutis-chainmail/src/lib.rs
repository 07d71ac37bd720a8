//! ChainMail: a grid of elements, such as the voxels of a CT volume, whose links give way up to a
//! limit.
//!
//! # The model
//!
//! Elements sit at the points of a grid, and neighbors along an axis are linked. A link along axis
//! `a` bounds the difference of its ends in every coordinate `c` (S. F. Gibson, *3D ChainMail*, I3D
//! 1997):
//!
//! ```text
//! lo[a][c] ≤ x_c(after) − x_c(before) ≤ hi[a][c]
//! ```
//!
//! Along the link (`c = a`) the bounds are its shortest and its longest length. Across the link
//! they are minus and plus the shear. Each end contributes half of a bound through its material. A
//! grabbed element goes exactly to its target. A neighbor moves only if a bound is violated, and
//! then as little as possible. Its move may violate the bounds of other links in turn.
//!
//! # The least move
//!
//! No bound mixes coordinates. The three coordinates are therefore independent, and each one is a
//! *system of difference constraints*. The solutions of such a system are closed under the
//! elementwise minimum and maximum. Consider all states in which the grabbed elements are at their
//! targets, the fixed elements have not moved, and every link is within its bounds. If there is
//! such a state, then there is one in which **each element has moved as little as in any other**:
//!
//! ```text
//! x′ = min(max(x, L), U)
//! L_j = max over grabbed g and paths g → j of  X_g + Σ lower bounds
//! U_j = min over grabbed g and paths g → j of  X_g + Σ upper bounds
//! ```
//!
//! [`Chain::drag`] finds this state in two passes: one only raises coordinates, the other only
//! lowers them. A pass ends because the state at rest satisfies all bounds, so that no cycle of
//! bounds gains anything. Its result does not depend on the order in which elements are visited. A
//! single first-in-first-out queue ([`Order::Fifo`]) and one queue per slab on any number of
//! threads ([`Order::Slabs`]) therefore give the same bits.
//!
//! There may be no solution, for example if two fixed rigid parts are pulled apart. A pass then
//! stops at the element that must not move and reports it ([`DragReport::contradictions`]). The
//! grabbed element is at its target nevertheless.
//!
//! # Numbers
//!
//! Coordinates are in steps of the grid along its axes, with 16 binary places in 32 bits
//! ([`UNITS_PER_STEP`]). With a step of 1 mm they resolve 15 nm. Arithmetic is exact. Only targets
//! are rounded, once, when they are converted to units.
//!
//! With the feature `gpu`, `RelaxGpu` relaxes a chain on a GPU to the same bits.

mod chain;
mod classic;
mod energy;
mod error;
#[cfg(feature = "gpu")]
mod gpu;
mod limits;
mod links;
mod material;
mod neighborhood;
mod pass;
mod plane;
mod relax;
mod simd;
mod units;
mod wave;

pub use chain::{Chain, NO_MATERIAL};
pub use classic::ClassicDragReport;
pub use energy::{LinkViolation, Violations};
pub use error::ChainError;
#[cfg(feature = "gpu")]
pub use gpu::RelaxGpu;
pub use material::{Material, MaterialTable};
pub use relax::Relaxation;
pub use units::{FARTHEST_STEPS, UNITS_PER_STEP};
pub use wave::{Contradiction, Drag, DragReport, Order};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
