//! Data on the device: round trips, padding, parts, limits and counters.

use std::ops::Range;

use cutis_gpu::{Counters, Gpu, GpuError, GpuOptions};
use cutis_test_kit::gpu::{on_each_adapter, on_each_adapter_with};

use crate::DOUBLE;

#[test]
fn reads_return_written_data() {
    on_each_adapter(|gpu| {
        let numbers: Vec<[f32; 4]> = (0..1000).map(|i| [i as f32, -0.0, f32::INFINITY, 1.5]).collect();
        let buffer = gpu.buffer("numbers", &numbers).unwrap();
        assert_eq!((buffer.len(), buffer.bytes()), (1000, 16_000));
        assert_eq!(gpu.read(&buffer, 0..1000).unwrap(), numbers);
        assert_eq!(gpu.read(&buffer, 17..40).unwrap(), numbers[17..40]);
        gpu.write(&buffer, 20, &[[9.0; 4], [8.0; 4]]).unwrap();
        assert_eq!(gpu.read(&buffer, 19..23).unwrap(), [numbers[19], [9.0; 4], [8.0; 4], numbers[22]]);
        assert_eq!(gpu.read(&buffer, 40..40).unwrap(), [[0.0; 4]; 0]);
        assert_eq!(gpu.read(&gpu.zeroed::<u32>("zeroed", 5).unwrap(), 0..5).unwrap(), [0; 5]);
    });
}

#[test]
fn an_empty_buffer_can_be_bound() {
    on_each_adapter(|gpu| {
        let empty = gpu.buffer::<[f32; 4]>("empty", &[]).unwrap();
        assert!(empty.is_empty());
        assert_eq!(empty.bytes(), 16);
        assert_eq!(gpu.read(&empty, 0..0).unwrap(), [[0.0; 4]; 0]);
        let kernel = gpu.kernel("double", DOUBLE, "double").unwrap();
        let group = gpu.bind(&kernel, 0, &[(0, empty.whole())]).unwrap();
        let mut pass = gpu.pass("nothing");
        pass.dispatch(&kernel, &[&group], empty.len());
        pass.submit().unwrap();
        assert_eq!(gpu.counters().submits, 0, "nothing to submit");
    });
}

#[test]
fn small_elements_can_be_read_anywhere_but_written_only_in_words() {
    on_each_adapter(|gpu| {
        let voxels: Vec<i16> = (0..7).map(|i| 100 - 50 * i).collect();
        let buffer = gpu.buffer("voxels", &voxels).unwrap();
        assert_eq!((buffer.len(), buffer.bytes()), (7, 16));
        for start in 0..7 {
            for end in start..=7 {
                assert_eq!(gpu.read(&buffer, start..end).unwrap(), voxels[start..end], "{start}..{end}");
            }
        }
        gpu.write(&buffer, 4, &[1_i16, 2, 3]).unwrap(); // up to the end
        gpu.write(&buffer, 0, &[7_i16, 8]).unwrap();
        assert_eq!(gpu.read(&buffer, 0..7).unwrap(), [7, 8, 0, -50, 1, 2, 3]);
        let misaligned = |offset: usize, data: &[i16]| match gpu.write(&buffer, offset, data) {
            Err(GpuError::Alignment { offset, multiple: 4, .. }) => offset,
            other => panic!("{other:?}"),
        };
        assert_eq!(misaligned(1, &[0, 0, 0]), 2);
        assert_eq!(misaligned(0, &[0]), 2);
        assert_eq!(gpu.read(&buffer, 0..7).unwrap(), [7, 8, 0, -50, 1, 2, 3], "nothing was written");
        let copy = gpu.zeroed::<i16>("copy", 3).unwrap();
        let mut pass = gpu.pass("copy of the end");
        pass.copy(&buffer, 4..7, &copy, 0);
        pass.submit().unwrap();
        assert_eq!(gpu.read(&copy, 0..3).unwrap(), [1, 2, 3]);
        let mut pass = gpu.pass("copy of the middle");
        pass.copy(&buffer, 1..3, &copy, 0);
        assert!(matches!(pass.submit(), Err(GpuError::Alignment { offset: 2, .. })));
    });
}

#[test]
fn large_data_are_transferred_in_parts() {
    on_each_adapter(|gpu| {
        let voxels: Vec<i16> = (0..18_000_001).map(|i| (i * 7 % 60_013 - 30_000) as i16).collect();
        let buffer = gpu.buffer("voxels", &voxels).unwrap();
        for range in [0..1, 0..voxels.len(), 3..voxels.len(), 1..voxels.len() - 2] {
            let read = gpu.read(&buffer, range.clone()).unwrap();
            assert!(read == voxels[range.clone()], "{range:?}");
        }
        assert_eq!(gpu.counters().readbacks, 4);
    });
}

#[test]
fn a_large_volume_is_uploaded_in_parts() {
    // Each thread reads three voxels, so that one dispatch within the baseline covers all of them.
    const COUNT: &str = "
        @group(0) @binding(0) var volume: texture_3d<i32>;
        @group(0) @binding(1) var<storage, read_write> differing: atomic<u32>;
        @compute @workgroup_size(64)
        fn count(@builtin(global_invocation_id) id: vec3<u32>) {
            let shape = textureDimensions(volume);
            for (var i = 3u * id.x; i < min(3u * id.x + 3u, shape.x * shape.y * shape.z); i++) {
                let at = vec3<u32>(i % shape.x, (i / shape.x) % shape.y, i / (shape.x * shape.y));
                if textureLoad(volume, at, 0).x != i32((i * 7u) % 60013u) - 30000 { atomicAdd(&differing, 1u); }
            }
        }";
    on_each_adapter_with(&GpuOptions { baseline_limits: true, ..GpuOptions::default() }, |gpu| {
        let shape: [usize; 3] = [251, 129, 272]; // 17.6 MB: more than one part of the upload
        let count: usize = shape.iter().product();
        let mut voxels: Vec<i16> = (0..count).map(|i| ((i * 7 % 60_013) as i32 - 30_000) as i16).collect();
        let kernel = gpu.kernel("count", COUNT, "count").unwrap();
        for (damaged, expected) in [(None, 0), (Some(0), 1), (Some(count - 1), 2)] {
            if let Some(at) = damaged {
                voxels[at] += 1;
            }
            let volume = gpu.texture_3d("volume", shape, &voxels).unwrap();
            let differing = gpu.zeroed::<u32>("differing", 1).unwrap();
            let group = gpu.bind(&kernel, 0, &[(0, volume.whole()), (1, differing.whole())]).unwrap();
            let mut pass = gpu.pass("count");
            pass.dispatch(&kernel, &[&group], count.div_ceil(3));
            pass.submit().unwrap();
            assert_eq!(gpu.read(&differing, 0..1).unwrap(), [expected]);
        }
    });
}

#[test]
fn sizes_beyond_the_limits_are_rejected_before_allocation() {
    on_each_adapter(|gpu| {
        let most = gpu.limits().max_buffer_bytes;
        for len in [usize::MAX, usize::MAX / 8, most as usize / 8 + 1] {
            match gpu.zeroed::<u64>("absurd", len) {
                Err(GpuError::Limit { what, needed, available, adapter }) => {
                    assert!(what.contains("'absurd'") && what.contains(&len.to_string()), "{what}");
                    assert!(needed > available);
                    assert_eq!((available, adapter), (most, gpu.adapter().name.clone()));
                }
                other => panic!("{len}: {other:?}"),
            }
        }
        let side = gpu.limits().max_texture_3d as usize + 1;
        for shape in [[usize::MAX; 3], [1, 1, side]] {
            assert!(
                matches!(gpu.texture_3d("absurd", shape, &[0]), Err(GpuError::Limit { .. })),
                "{shape:?}"
            );
        }
        for (shape, voxels) in [([2, 2, 2], &[0_i16; 7][..]), ([0, 2, 2], &[])] {
            assert!(
                matches!(gpu.texture_3d("wrong", shape, voxels), Err(GpuError::Validation { .. })),
                "{shape:?}"
            );
        }
        assert_eq!(gpu.counters(), Counters::default(), "nothing was created");
    });
}

#[test]
fn ranges_outside_of_a_buffer_are_rejected() {
    on_each_adapter(|gpu| {
        let buffer = gpu.buffer("four", &[1_u32, 2, 3, 4]).unwrap();
        let other = gpu.zeroed::<u32>("two", 2).unwrap();
        #[allow(clippy::reversed_empty_ranges, reason = "the test needs invalid ranges")]
        let outside: [Range<usize>; 4] = [0..5, 3..2, 5..5, usize::MAX - 1..usize::MAX];
        for range in outside {
            let error = gpu.read(&buffer, range.clone()).unwrap_err();
            assert!(matches!(error, GpuError::Range { len: 4, .. }), "{range:?}: {error}");
            let kernel = gpu.kernel("double", DOUBLE, "double").unwrap();
            let bound = gpu.bind(&kernel, 0, &[(0, buffer.range(range.clone()))]);
            assert!(matches!(bound, Err(GpuError::Range { len: 4, .. })), "{range:?}");
            let mut pass = gpu.pass("copy");
            pass.copy(&buffer, range.clone(), &other, 0);
            assert!(matches!(pass.submit(), Err(GpuError::Range { .. })), "{range:?}");
        }
        for offset in [1, usize::MAX] {
            assert!(matches!(gpu.write(&buffer, offset, &[0; 4]), Err(GpuError::Range { .. })));
            let mut pass = gpu.pass("copy");
            pass.copy(&buffer, 0..2, &other, offset);
            assert!(matches!(pass.submit(), Err(GpuError::Range { .. })));
        }
        assert_eq!(gpu.read(&buffer, 0..4).unwrap(), [1, 2, 3, 4]);
    });
}

#[test]
fn counters_report_work_and_memory() {
    on_each_adapter(|gpu| {
        let kernel = gpu.kernel("double", DOUBLE, "double").unwrap();
        let values = gpu.buffer("values", &[1.0_f32; 100]).unwrap();
        let before = gpu.counters();
        assert_eq!(before, Counters { kernels: 1, buffers: 1, buffer_bytes: 400, ..Counters::default() });
        {
            let _other = gpu.buffer("other", &[0_i16; 3]).unwrap();
            let _volume = gpu.texture_3d("volume", [2, 2, 2], &[0; 8]).unwrap();
            assert_eq!(gpu.counters().buffer_bytes, 408);
            assert_eq!(gpu.counters().texture_bytes, 16);
        }
        let group = gpu.bind(&kernel, 0, &[(0, values.whole())]).unwrap();
        let mut pass = gpu.pass("three of them");
        (0..3).for_each(|_| pass.dispatch(&kernel, &[&group], 100));
        pass.dispatch(&kernel, &[&group], 0);
        pass.submit().unwrap();
        drop(gpu.pass("not submitted"));
        gpu.write(&values, 0, &[3.0]).unwrap();
        gpu.read(&values, 0..10).unwrap();
        gpu.read(&values, 5..6).unwrap();
        gpu.clone().wait().unwrap();
        let expected = Counters {
            buffers: 2,
            textures: 1,
            submits: 1,
            dispatches: 3,
            writes: 1,
            readbacks: 2,
            readback_bytes: 44,
            ..before
        };
        assert_eq!(gpu.counters(), expected);
        drop(values);
        assert_eq!(gpu.counters().buffer_bytes, 400, "the group still holds it");
        drop(group);
        assert_eq!(gpu.counters().buffer_bytes, 0);
    });
}

#[test]
fn a_chunk_fits_one_dispatch_and_one_binding() {
    let baseline = GpuOptions { baseline_limits: true, ..GpuOptions::default() };
    let lengths = |gpu: &Gpu| [0, 4, 16, 64, usize::MAX].map(|bytes| gpu.chunk_len(bytes));
    on_each_adapter_with(&baseline, |gpu| {
        let threads = 65_535 * 64;
        assert_eq!(lengths(gpu), [threads, threads, threads, (128 << 20) / 64, 1]);
    });
    for (cap, expected) in [(3, 3), (0, 1)] {
        on_each_adapter_with(&GpuOptions { chunk_cap: Some(cap), ..baseline.clone() }, |gpu| {
            assert_eq!(lengths(gpu), [expected, expected, expected, expected, 1]);
        });
    }
    on_each_adapter_with(&baseline, |gpu| {
        let values = gpu.buffer("values", &[1.0_f32]).unwrap();
        let kernel = gpu.kernel("double", DOUBLE, "double").unwrap();
        let group = gpu.bind(&kernel, 0, &[(0, values.whole())]).unwrap();
        for threads in [gpu.chunk_len(4) + 1, usize::MAX] {
            let mut pass = gpu.pass("too many");
            pass.dispatch(&kernel, &[&group], threads);
            assert!(matches!(pass.submit(), Err(GpuError::Limit { available: 65_535, .. })), "{threads}");
        }
        let mut pass = gpu.pass("as many as go");
        pass.dispatch(&kernel, &[&group], gpu.chunk_len(4));
        pass.submit().unwrap();
        assert_eq!(gpu.read(&values, 0..1).unwrap(), [2.0]);
    });
}
