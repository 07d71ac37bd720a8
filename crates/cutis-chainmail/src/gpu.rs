//! Relaxation by a GPU: the bits of [`Chain::relax`](crate::Chain::relax).
//!
//! A sweep is six halves: for each coordinate the elements whose `i + j + k` is even, then the odd ones. Positions lie on the device by
//! coordinate, in slabs of whole planes that a binding can hold; a slab reads the planes next to it where they lie. Several sweeps
//! are submitted at once, and each counts what moved. Once a sweep moves nothing, those after it do nothing, so that the host
//! need not look in between.
//!
//! | on the device | bytes for each element | goes up |
//! |---|---|---|
//! | positions | 12 | with every call, and back at its end |
//! | links, fixed and held elements, materials | 2 (and as many on the host) | planes that changed |
//! | bounds by pair of materials, `k` | | when they changed |

mod mirror;
mod relaxation;
mod slab;
mod uniform;

pub use relaxation::RelaxGpu;
