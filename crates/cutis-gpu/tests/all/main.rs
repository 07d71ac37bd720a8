//! Integration tests on every adapter of the machine.

mod compute;
mod errors;
mod memory;

use cutis_gpu::Gpu;

/// A kernel that doubles numbers.
const DOUBLE: &str = "
    @group(0) @binding(0) var<storage, read_write> values: array<f32>;
    @compute @workgroup_size(64)
    fn double(@builtin(global_invocation_id) id: vec3<u32>) {
        if id.x < arrayLength(&values) { values[id.x] = 2.0 * values[id.x]; }
    }";

/// Runs [`DOUBLE`] on these numbers.
fn doubled(gpu: &Gpu, numbers: &[f32]) -> Vec<f32> {
    let values = gpu.buffer("values", numbers).unwrap();
    let kernel = gpu.kernel("double", DOUBLE, "double").unwrap();
    let group = gpu.bind(&kernel, 0, &[(0, values.whole())]).unwrap();
    let mut pass = gpu.pass("double");
    pass.dispatch(&kernel, &[&group], values.len());
    pass.submit().unwrap();
    gpu.read(&values, 0..numbers.len()).unwrap()
}
