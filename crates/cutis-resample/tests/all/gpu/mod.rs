//! Resampling by a GPU: against its scalar twin, bit for bit, and against closed forms and the CPU in `f64`.
//!
//! Without an adapter the tests say so and do nothing, unless `CI` is set: then that is a failure.

#[path = "../common/mod.rs"]
mod common;
mod contract;
mod device;
mod oracle;
mod parity;
mod real;
mod scenes;

use cutis_gpu::{Gpu, GpuError, GpuOptions};

/// The first adapter, opened with these options.
fn open(options: GpuOptions) -> Option<Gpu> {
    let required = ["CI", "CUTIS_REQUIRE_GPU"].iter().any(|name| std::env::var_os(name).is_some());
    match Gpu::open(&options) {
        Ok(gpu) => Some(gpu),
        Err(GpuError::NoAdapter) if !required => {
            eprintln!("skipped: {}", GpuError::NoAdapter);
            None
        }
        Err(error) => panic!("{error}"),
    }
}

fn gpu() -> Option<Gpu> {
    open(GpuOptions::default())
}
