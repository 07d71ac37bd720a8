//! Compute on any GPU, through wgpu.
//!
//! This is the only crate of Cutis that uses wgpu, and no type of wgpu appears in its public API.
//! It provides adapters by name or index, typed buffers, volumes as integer textures, kernels in
//! WGSL, one compute pass per submission, and readbacks.
//!
//! # Guarantees
//!
//! - Nothing panics on invalid input, an invalid shader or a lost device. Every failure is a
//!   [`GpuError`].
//! - Sizes are checked against the limits of the device before memory is allocated.
//! - After the loss of the device, every call that uses it returns [`GpuError::Lost`]. Data on the
//!   host do not change.
//! - Writes, passes and reads of one [`Gpu`] take effect in the order of the calls of
//!   [`Gpu::write`], [`Pass::submit`] and [`Gpu::read`], not in the order in which passes are
//!   recorded.
//! - Every kernel has `@workgroup_size(64)` ([`WORKGROUP`]). [`Gpu::kernel`] rejects other sizes.
//! - Threads can share handles.
//!
//! # Example
//!
//! ```
//! use cutis_gpu::{Gpu, GpuError, GpuOptions};
//!
//! const DOUBLE: &str = "
//!     @group(0) @binding(0) var<storage, read_write> values: array<f32>;
//!     @compute @workgroup_size(64)
//!     fn double(@builtin(global_invocation_id) id: vec3<u32>) {
//!         if id.x < arrayLength(&values) { values[id.x] = 2.0 * values[id.x]; }
//!     }";
//!
//! fn main() -> Result<(), GpuError> {
//!     let gpu = match Gpu::open(&GpuOptions::default()) {
//!         Err(GpuError::NoAdapter) => return Ok(()), // this machine has no adapter
//!         opened => opened?,
//!     };
//!     let values = gpu.buffer("values", &[1.0_f32, 2.0, 3.0])?;
//!     let double = gpu.kernel("double", DOUBLE, "double")?;
//!     let group = gpu.bind(&double, 0, &[(0, values.whole())])?;
//!     let mut pass = gpu.pass("double all");
//!     pass.dispatch(&double, &[&group], values.len());
//!     pass.submit()?;
//!     assert_eq!(gpu.read(&values, 0..3)?, [2.0, 4.0, 6.0]);
//!     Ok(())
//! }
//! ```
#![forbid(unsafe_code)]

mod adapter;
mod buffer;
mod counters;
mod device;
mod error;
mod kernel;
mod limits;
mod pass;
mod readback;
mod select;
mod texture;
mod timing;

pub use adapter::{Adapter, AdapterKind, adapters};
pub use buffer::Buffer;
pub use counters::Counters;
pub use device::{Gpu, GpuOptions};
pub use error::GpuError;
pub use kernel::{BindGroup, Binding, Kernel};
pub use limits::Limits;
pub use pass::Pass;
pub use select::Select;
pub use texture::Texture3d;

/// Number of threads of a workgroup. Every kernel has `@compute @workgroup_size(64)`.
pub const WORKGROUP: usize = 64;
