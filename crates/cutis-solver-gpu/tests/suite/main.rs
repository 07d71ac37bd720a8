//! The GPU backend against the reference, on every adapter of the machine.

mod body;
mod device;
mod parity;
mod readbacks;
mod state;

use cutis_gpu::{AdapterKind, Gpu, GpuOptions, Select};

/// Opens each adapter with `options` in turn. Without an adapter the test is left out with a word, or fails where one is
/// required.
fn on_each_adapter(options: GpuOptions, mut test: impl FnMut(&Gpu)) {
    let adapters = cutis_gpu::adapters();
    if adapters.is_empty() {
        let required = ["CI", "CUTIS_REQUIRE_GPU"].iter().any(|name| std::env::var_os(name).is_some());
        assert!(!required, "this test needs a GPU adapter; a software one is enough");
        eprintln!("left out: there is no GPU adapter");
    }
    for adapter in adapters {
        let options = GpuOptions { select: Select::Index(adapter.index), ..options.clone() };
        test(&Gpu::open(&options).unwrap());
    }
}

/// Whether the device computes with the bits of the CPU: software does, hardware may fuse operations.
fn is_exact(gpu: &Gpu) -> bool {
    gpu.adapter().kind == AdapterKind::Software
}
