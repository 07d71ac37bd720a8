//! Tests on every GPU adapter of the machine.

use cutis_gpu::{AdapterKind, Gpu, GpuOptions, Select};

/// True if a test without an adapter must fail: `CI` or `CUTIS_REQUIRE_GPU` is set.
#[must_use]
pub fn required() -> bool {
    ["CI", "CUTIS_REQUIRE_GPU"].iter().any(|name| std::env::var_os(name).is_some())
}

/// Opens every adapter with `options` and runs `test` on it. Without an adapter the test is
/// skipped, and the reason is printed.
///
/// # Panics
/// If there is no adapter and one is [`required`], or if an adapter cannot be opened.
pub fn on_each_adapter_with(options: &GpuOptions, mut test: impl FnMut(&Gpu)) {
    let adapters = cutis_gpu::adapters();
    if adapters.is_empty() {
        assert!(!required(), "this test needs a GPU adapter; a software adapter is enough");
        eprintln!("skipped: there is no GPU adapter");
    }
    for adapter in adapters {
        let options = GpuOptions { select: Select::Index(adapter.index), ..options.clone() };
        test(&Gpu::open(&options).unwrap_or_else(|error| panic!("{}: {error}", adapter.name)));
    }
}

/// As [`on_each_adapter_with`], with default options.
pub fn on_each_adapter(test: impl FnMut(&Gpu)) {
    on_each_adapter_with(&GpuOptions::default(), test);
}

/// True if the device gives the same bits as the CPU. Software adapters do; hardware may fuse
/// operations.
#[must_use]
pub fn is_exact(gpu: &Gpu) -> bool {
    gpu.adapter().kind == AdapterKind::Software
}
