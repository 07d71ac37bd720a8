//! The solution of the equations of a search on a GPU.
//!
//! The CPU fills the matrix of a Newton step and builds the levels, as for a search on the CPU. The
//! device has a copy of them in single precision, and makes all cycles and all steps of conjugate
//! gradients. The host receives some sums in each cycle, from which it decides when to end, and the
//! solution at the end.
//!
//! | on the device | bytes | uploaded |
//! |---|---|---|
//! | the matrix of each level | 40 per block of three unknowns, 148 per block of six | the finest one in each Newton step, the others with the levels |
//! | the way between two levels, in both directions | 152 or 296 per block | with the levels |
//! | the factor on the last level | 8 per number | with the levels |
//! | vectors | 144 per vertex | the right-hand side in each Newton step |
//!
//! Matrices have both triangles, in slices of 16 or 8 rows: see `sliced.rs`. They are split to fit
//! the bindings of the device. Vectors are not.

mod bottom;
mod device;
mod equations;
mod kernels;
mod level;
mod levels;
mod patch;
mod rows;
mod sliced;
mod step;
#[cfg(test)]
mod tests;
mod uniform;

pub use device::RestGpu;
pub(crate) use equations::GpuEquations;
