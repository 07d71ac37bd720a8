//! Relaxation on a GPU, with the same bits as [`Chain::relax`](crate::Chain::relax).
//!
//! A sweep has six parts: for each coordinate the elements whose `i + j + k` is even, then the odd
//! ones. Positions are stored by coordinate, in slabs of whole planes that fit into one binding. A
//! slab reads the neighboring planes from the neighboring slabs' buffers. One submission holds
//! several sweeps, and each sweep counts the elements that it moved. When a sweep moves nothing,
//! the sweeps after it do nothing, so that the host does not have to check in between.
//!
//! | on the device | bytes per element | uploaded |
//! |---|---|---|
//! | positions | 12 | with every call, and read back at its end |
//! | links, fixed and held elements, materials | 2 (and as many on the host) | planes that changed |
//! | bounds by pair of materials, `k` | | when they changed |

mod mirror;
mod relaxation;
mod slab;
mod uniform;

pub use relaxation::RelaxGpu;
