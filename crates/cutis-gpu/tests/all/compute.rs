//! Results of kernels.

use cutis_gpu::{Gpu, GpuOptions};
use cutis_test_kit::gpu::{on_each_adapter, on_each_adapter_with};

use crate::{DOUBLE, doubled};

const NUMBERS: [f32; 5] = [1.0, -2.5, 0.0, 3.25e7, 1.0e-30];

#[test]
fn a_kernel_doubles_numbers() {
    on_each_adapter(|gpu| {
        assert_eq!(doubled(gpu, &NUMBERS), NUMBERS.map(|number| 2.0 * number));
        assert_ne!(doubled(gpu, &NUMBERS), NUMBERS);
    });
}

#[test]
fn a_dispatch_covers_several_workgroups_and_a_part_of_one() {
    on_each_adapter(|gpu| {
        let numbers: Vec<f32> = (0..1000).map(|i| i as f32).collect();
        let expected: Vec<f32> = numbers.iter().map(|number| 2.0 * number).collect();
        assert_eq!(doubled(gpu, &numbers), expected);
    });
}

#[test]
fn a_pass_runs_in_order_with_copies_between() {
    on_each_adapter(|gpu| {
        let from = gpu.buffer("from", &[1.0_f32, 2.0, 3.0, 4.0]).unwrap();
        let to = gpu.zeroed::<f32>("to", 4).unwrap();
        let kernel = gpu.kernel("double", DOUBLE, "double").unwrap();
        let one = gpu.bind(&kernel, 0, &[(0, from.whole())]).unwrap();
        let other = gpu.bind(&kernel, 0, &[(0, to.whole())]).unwrap();
        let mut pass = gpu.pass("in order");
        pass.dispatch(&kernel, &[&one], 4); // from: 2 4 6 8
        pass.copy(&from, 1..3, &to, 2); // to: 0 0 4 6
        pass.dispatch(&kernel, &[&one], 4); // from: 4 8 12 16
        pass.dispatch(&kernel, &[&other], 4); // to: 0 0 8 12
        pass.submit().unwrap();
        assert_eq!(gpu.read(&from, 0..4).unwrap(), [4.0, 8.0, 12.0, 16.0]);
        assert_eq!(gpu.read(&to, 0..4).unwrap(), [0.0, 0.0, 8.0, 12.0]);
    });
}

#[test]
fn a_kernel_writes_only_the_bound_part_of_a_buffer() {
    on_each_adapter(|gpu| {
        let values = gpu.buffer("values", &[1.0_f32; 130]).unwrap();
        let kernel = gpu.kernel("double", DOUBLE, "double").unwrap();
        let group = gpu.bind(&kernel, 0, &[(0, values.range(64..128))]).unwrap();
        let mut pass = gpu.pass("part");
        pass.dispatch(&kernel, &[&group], 64);
        pass.submit().unwrap();
        let expected: Vec<f32> = (0..130).map(|i| if (64..128).contains(&i) { 2.0 } else { 1.0 }).collect();
        assert_eq!(gpu.read(&values, 0..130).unwrap(), expected);
    });
}

#[test]
fn a_kernel_reads_a_volume() {
    const SUM: &str = "
        struct Params { nx: u32, ny: u32, nz: u32, offset: i32 }
        @group(0) @binding(0) var volume: texture_3d<i32>;
        @group(0) @binding(1) var<storage, read_write> out: array<i32>;
        @group(1) @binding(0) var<uniform> params: Params;
        @compute @workgroup_size(64)
        fn shift(@builtin(global_invocation_id) id: vec3<u32>) {
            if id.x >= params.nx * params.ny * params.nz { return; }
            let at = vec3<u32>(id.x % params.nx, (id.x / params.nx) % params.ny, id.x / (params.nx * params.ny));
            out[id.x] = textureLoad(volume, at, 0).x + params.offset;
        }";
    on_each_adapter(|gpu| {
        let shape = [7, 5, 3];
        let voxels: Vec<i16> = (0..105).map(|i| (i * 611 - 32_000) as i16).collect();
        let volume = gpu.texture_3d("volume", shape, &voxels).unwrap();
        assert_eq!(volume.shape(), shape);
        let out = gpu.zeroed::<i32>("out", voxels.len()).unwrap();
        let params = gpu.uniform("params", &[7, 5, 3, -1000]).unwrap();
        let kernel = gpu.kernel("shift", SUM, "shift").unwrap();
        let data = gpu.bind(&kernel, 0, &[(0, volume.whole()), (1, out.whole())]).unwrap();
        let settings = gpu.bind(&kernel, 1, &[(0, params.whole())]).unwrap();
        let mut pass = gpu.pass("shift");
        pass.dispatch(&kernel, &[&settings, &data], voxels.len()); // the order of groups does not matter
        pass.submit().unwrap();
        let expected: Vec<i32> = voxels.iter().map(|&voxel| i32::from(voxel) - 1000).collect();
        assert_eq!(gpu.read(&out, 0..voxels.len()).unwrap(), expected);
    });
}

#[test]
fn baseline_limits_give_the_same_results() {
    on_each_adapter_with(&GpuOptions { baseline_limits: true, ..GpuOptions::default() }, |gpu| {
        assert_eq!(gpu.limits().max_buffer_bytes, 256 << 20);
        assert_eq!(gpu.limits().max_binding_bytes, 128 << 20);
        assert_eq!(gpu.limits().max_workgroups, 65_535);
        assert_eq!(gpu.limits().storage_buffers_per_stage, 8);
        assert_eq!(doubled(gpu, &NUMBERS), NUMBERS.map(|number| 2.0 * number));
    });
}

#[test]
fn devices_and_threads_work_in_parallel() {
    on_each_adapter(|gpu| {
        let options =
            GpuOptions { select: cutis_gpu::Select::Index(gpu.adapter().index), ..GpuOptions::default() };
        let second = Gpu::open(&options).unwrap();
        std::thread::scope(|scope| {
            for handle in [gpu.clone(), gpu.clone(), second] {
                scope.spawn(move || {
                    for round in 0..20 {
                        let numbers: Vec<f32> = (0..200).map(|i| (i + round) as f32).collect();
                        let expected: Vec<f32> = numbers.iter().map(|number| 2.0 * number).collect();
                        assert_eq!(doubled(&handle, &numbers), expected);
                    }
                });
            }
        });
        assert_eq!(gpu.counters().submits, 40);
    });
}

/// A thread that waits for the device may run the callback of another thread's read.
#[test]
fn reads_complete_while_other_threads_wait_for_the_device() {
    on_each_adapter(|gpu| {
        let buffers = [1_u32, 2].map(|value| gpu.buffer("values", &[value; 16]).unwrap());
        let done = std::sync::atomic::AtomicUsize::new(0);
        let (gpu, done) = (&gpu, &done);
        std::thread::scope(|scope| {
            for (value, buffer) in (1..).zip(&buffers) {
                scope.spawn(move || {
                    let read = (0..500).try_for_each(|_| match gpu.read(buffer, 0..16) {
                        Ok(read) if read == [value; 16] => Ok(()),
                        other => Err(format!("{other:?}")),
                    });
                    done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
                    read.unwrap();
                });
                scope.spawn(move || {
                    while done.load(std::sync::atomic::Ordering::Relaxed) < 2 {
                        gpu.wait().unwrap();
                    }
                });
            }
        });
    });
}

#[test]
fn passes_are_timed_if_the_adapter_supports_it() {
    on_each_adapter_with(&GpuOptions { timestamps: true, ..GpuOptions::default() }, |gpu| {
        assert_eq!(gpu.last_pass_ns(), Ok(None));
        doubled(gpu, &NUMBERS);
        let readbacks = gpu.counters().readbacks;
        let time = gpu.last_pass_ns().unwrap();
        assert_eq!(time.is_some(), gpu.adapter().timestamps);
        assert_eq!(gpu.counters().readbacks, readbacks);
        assert!(time.is_none_or(|ns| ns < 60_000_000_000), "{time:?} ns");
    });
    on_each_adapter(|gpu| {
        doubled(gpu, &NUMBERS);
        assert_eq!(gpu.last_pass_ns(), Ok(None), "timestamps are off");
    });
}
