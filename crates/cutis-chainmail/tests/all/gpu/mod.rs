//! Relaxation by a GPU against [`Chain::relax`](cutis_chainmail::Chain::relax): the same positions and counts on any adapter.
//!
//! Without an adapter the tests say so and do nothing, unless `CI` is set: then that is a failure.

mod bodies;
mod controls;
mod device;
mod parity;
#[path = "../all/random.rs"]
mod random;

use cutis_chainmail::{Chain, Relaxation};
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

/// The device as it is, and with memory and limits that split every grid.
fn devices() -> Option<[Gpu; 3]> {
    let split = |cap| GpuOptions { chunk_cap: Some(cap), baseline_limits: true, ..GpuOptions::default() };
    Some([gpu()?, open(split(1))?, open(split(150))?])
}

/// What is compared: what relaxation said, and where all elements are, in units.
fn outcome(chain: &Chain, done: Relaxation) -> (Relaxation, Vec<[i32; 3]>) {
    (done, (0..chain.places() as u32).map(|element| chain.units(element)).collect())
}
