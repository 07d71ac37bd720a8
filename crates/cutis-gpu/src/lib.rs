//! Compute on any GPU, through wgpu.
//!
//! This is the only crate of Cutis that names wgpu. It offers what a solver needs and no more: adapters by name or
//! index, typed buffers, volumes as integer textures, kernels in WGSL, one compute pass per submission, reading back.
//! No type of wgpu shows in the public API.
//!
//! # What holds
//!
//! - Nothing panics on bad input, a bad shader or a device that is lost: every failure is a [`GpuError`].
//! - Sizes are checked against the limits of the device before memory is asked for.
//! - After the device is lost every call that reaches it returns [`GpuError::Lost`]; data on the host stay as they were.
//! - Writes, passes and reads of one [`Gpu`] take effect in the order of the calls [`Gpu::write`], [`Pass::submit`] and
//!   [`Gpu::read`], not in the order in which passes are recorded.
//! - Every kernel has `@workgroup_size(64)` ([`WORKGROUP`]); a kernel with another one is refused.
//! - Handles may be shared between threads.
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
//!         Err(GpuError::NoAdapter) => return Ok(()), // nothing to run on
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

/// Threads of a workgroup in every kernel: `@compute @workgroup_size(64)`.
pub const WORKGROUP: usize = 64;
