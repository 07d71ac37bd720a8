//! Opens every adapter of the machine.
#![allow(dead_code, reason = "each test binary uses its own part")]

use cutis_gpu::{Gpu, GpuOptions, Select, adapters};

/// A kernel that doubles numbers.
pub const DOUBLE: &str = "
    @group(0) @binding(0) var<storage, read_write> values: array<f32>;
    @compute @workgroup_size(64)
    fn double(@builtin(global_invocation_id) id: vec3<u32>) {
        if id.x < arrayLength(&values) { values[id.x] = 2.0 * values[id.x]; }
    }";

/// Runs a test on every adapter. Without one the test is skipped with a reason, or fails where CI or CUTIS_REQUIRE_GPU is set.
pub fn on_every_adapter(test: impl Fn(Gpu)) {
    with_options(&GpuOptions::default(), test);
}

/// The same with options other than the choice of the adapter.
pub fn with_options(options: &GpuOptions, test: impl Fn(Gpu)) {
    let found = adapters();
    if found.is_empty() {
        let required = ["CI", "CUTIS_REQUIRE_GPU"].iter().any(|name| std::env::var_os(name).is_some());
        assert!(!required, "a GPU adapter is required, and there is none");
        eprintln!("skipped: no GPU adapter");
    }
    for adapter in found {
        let options = GpuOptions { select: Select::Index(adapter.index), ..options.clone() };
        test(Gpu::open(&options).unwrap_or_else(|error| panic!("{}: {error}", adapter.name)));
    }
}

/// Runs [`DOUBLE`] on these numbers.
pub fn doubled(gpu: &Gpu, numbers: &[f32]) -> Vec<f32> {
    let values = gpu.buffer("values", numbers).unwrap();
    let kernel = gpu.kernel("double", DOUBLE, "double").unwrap();
    let group = gpu.bind(&kernel, 0, &[(0, values.whole())]).unwrap();
    let mut pass = gpu.pass("double");
    pass.dispatch(&kernel, &[&group], values.len());
    pass.submit().unwrap();
    gpu.read(&values, 0..numbers.len()).unwrap()
}
