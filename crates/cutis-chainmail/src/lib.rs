//! ChainMail: a grid of elements, such as the voxels of a CT volume, held together by links that give way up to a limit.
//!
//! # The model
//!
//! Elements sit at the points of a grid, and neighbors along an axis are linked. A link along axis `a` bounds, for every
//! coordinate `c`, the difference of its ends (S. F. Gibson, *3D ChainMail*, I3D 1997):
//!
//! ```text
//! lo[a][c] ≤ x_c(after) − x_c(before) ≤ hi[a][c]
//! ```
//!
//! Along the link (`c = a`) these are the shortest and longest length, across it ± the shear. They come from the materials at
//! both ends, half from each. Whoever is grabbed goes where it is told; a neighbor moves only if a bound is violated, and
//! then by the least that satisfies it; that may violate others in turn.
//!
//! # What that is
//!
//! The bounds never mix coordinates, so that the three are independent, and each is a *system of difference constraints*. Its
//! solutions are closed under the elementwise minimum and maximum. Of all states in which the grabbed elements are where
//! they were told, the fixed ones where they were, and every link within its bounds, there is therefore one in which
//! **each element has moved the least that it moves in any of them**:
//!
//! ```text
//! x′ = min(max(x, L), U)
//! L_j = max over grabbed g and paths g → j of  X_g + Σ lower bounds,     U_j = min of  X_g + Σ upper bounds
//! ```
//!
//! [`Chain::drag`] finds it in two passes, one that only raises and one that only lowers coordinates. A pass ends, because no cycle
//! of bounds gains anything while the body at rest satisfies them; and its end does not depend on the order in which elements are
//! looked at. So one first-in-first-out queue (the wave of [`Order::Fifo`]) and a queue for each of many slabs, on any number of threads
//! ([`Order::Slabs`]), give the same bits.
//!
//! There is no such state if, say, two fixed rigid parts are pulled apart. A pass then stops at the element that must not move,
//! and says so ([`Moved::contradictions`]); the grabbed element is where it was told all the same.
//!
//! # Numbers
//!
//! Coordinates are in steps of the grid along its axes, with 16 binary places in 32 bits ([`UNITS_PER_STEP`]): at 1 mm they
//! are 15 nm apart. All arithmetic is exact, and what is told in steps is rounded once, on the way in.
//!
//! With the feature `gpu` a GPU relaxes a chain, to the same bits: `RelaxGpu`.

mod blade;
mod census;
mod chain;
mod classic;
mod energy;
mod error;
#[cfg(feature = "gpu")]
mod gpu;
mod limits;
mod links;
mod material;
mod pass;
mod plane;
mod relax;
mod units;
mod wave;
mod wide;

pub use blade::Blade;
pub use chain::{Chain, NO_MATERIAL};
pub use classic::ClassicMoved;
pub use energy::{LinkViolation, Violations};
pub use error::ChainError;
#[cfg(feature = "gpu")]
pub use gpu::RelaxGpu;
pub use material::{Material, MaterialTable};
pub use relax::Relaxation;
pub use units::{FARTHEST_STEPS, UNITS_PER_STEP};
pub use wave::{Contradiction, Drag, Moved, Order};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
