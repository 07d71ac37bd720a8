//! Relaxation on a GPU gives the same positions and counts as
//! [`Chain::relax`](cutis_chainmail::Chain::relax), on every adapter.

mod bodies;
mod controls;
mod device;
mod parity;

use cutis_chainmail::{Chain, Relaxation};
use cutis_gpu::{Gpu, GpuOptions, Select};
use cutis_test_kit::gpu::on_each_adapter;

/// Runs a test on each adapter, opened three times: as it is, and twice with a memory limit that
/// splits every grid into slabs.
fn on_each_adapter_split(mut test: impl FnMut(&[Gpu; 3])) {
    on_each_adapter(|gpu| {
        let select = Select::Index(gpu.adapter().index);
        let open = |chunk_cap| {
            let chunk_cap = Some(chunk_cap);
            let options = GpuOptions {
                select: select.clone(),
                chunk_cap,
                baseline_limits: true,
                ..GpuOptions::default()
            };
            Gpu::open(&options).unwrap()
        };
        test(&[gpu.clone(), open(1), open(150)]);
    });
}

/// The result of a relaxation with the positions of all elements in units.
fn result(chain: &Chain, relaxation: Relaxation) -> (Relaxation, Vec<[i32; 3]>) {
    (relaxation, (0..chain.places() as u32).map(|element| chain.units(element)).collect())
}
