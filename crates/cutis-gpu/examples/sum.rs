//! A sum of ten million numbers on every adapter of the machine, with a reduction in workgroups.
//!
//! `cargo run -p cutis-gpu --example sum`
#![allow(clippy::print_stdout, reason = "an example prints its result")]

use cutis_gpu::{Gpu, GpuError, GpuOptions, Select, WORKGROUP, adapters};

/// Each workgroup adds up its part of the numbers and writes one sum.
const SUM: &str = "
    @group(0) @binding(0) var<storage, read> numbers: array<u32>;
    @group(0) @binding(1) var<storage, read_write> sums: array<u32>;
    var<workgroup> part_sums: array<u32, 64>;

    @compute @workgroup_size(64)
    fn sum(
        @builtin(global_invocation_id) id: vec3u,
        @builtin(local_invocation_index) local: u32,
        @builtin(workgroup_id) workgroup: vec3u,
        @builtin(num_workgroups) workgroups: vec3u,
    ) {
        var total = 0u;
        for (var i = id.x; i < arrayLength(&numbers); i += 64u * workgroups.x) {
            total += numbers[i];
        }
        part_sums[local] = total;
        for (var half = 32u; half > 0u; half /= 2u) {
            workgroupBarrier();
            if local < half { part_sums[local] += part_sums[local + half]; }
        }
        if local == 0u { sums[workgroup.x] = part_sums[0]; }
    }";

fn main() -> Result<(), GpuError> {
    let adapters = adapters();
    if adapters.is_empty() {
        println!("{}", GpuError::NoAdapter);
    }
    let numbers: Vec<u32> = (0..10_000_000).map(|n| n % 100).collect();
    let expected: u32 = numbers.iter().sum();
    for adapter in adapters {
        let options =
            GpuOptions { select: Select::Index(adapter.index), timestamps: true, ..Default::default() };
        let gpu = match Gpu::open(&options) {
            Ok(gpu) => gpu,
            Err(error) => {
                println!("{error}");
                continue;
            }
        };
        let workgroups = 1000;
        let input = gpu.buffer("numbers", &numbers)?;
        let sums = gpu.zeroed::<u32>("sums", workgroups)?;
        let kernel = gpu.kernel("sum", SUM, "sum")?;
        let group = gpu.bind(&kernel, 0, &[(0, input.whole()), (1, sums.whole())])?;
        let mut pass = gpu.pass("sum");
        pass.dispatch(&kernel, &[&group], workgroups * WORKGROUP);
        pass.submit()?;
        let found: u32 = gpu.read(&sums, 0..workgroups)?.iter().sum();
        let time = gpu.last_pass_ns()?.map_or("not measured".to_owned(), |ns| format!("{} µs", ns / 1000));
        println!("{} ({}): {found}, expected {expected}, device time: {time}", adapter.name, adapter.kind);
        assert_eq!(found, expected);
    }
    Ok(())
}
