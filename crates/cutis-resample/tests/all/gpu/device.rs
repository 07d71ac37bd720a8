//! Splitting, limits, positions on the device, and errors.

use cutis_gpu::{Gpu, GpuError, GpuOptions, Select};
use cutis_resample::{ResampleError, ResamplerGpu, ResamplerOptions, resample_gpu};
use cutis_test_kit::gpu::on_each_adapter;
use nalgebra::Point3;

use super::scenes::{self, Scene};

fn quiet(_done: usize, _total: usize) {}

fn resampler(gpu: &Gpu, scene: &Scene) -> ResamplerGpu {
    ResamplerGpu::new(gpu, &scene.volume, &scene.warp(), &ResamplerOptions::centered(&scene.warp())).unwrap()
}

#[test]
fn splitting_the_work_changes_no_bit() {
    on_each_adapter(|whole| {
        let select = Select::Index(whole.adapter().index);
        let open = |chunk_cap, baseline_limits| {
            let select = select.clone();
            Gpu::open(&GpuOptions { select, chunk_cap, baseline_limits, ..GpuOptions::default() }).unwrap()
        };
        let (tiny, odd, baseline) = (open(Some(7), false), open(Some(65), true), open(None, true));
        for scene in scenes::all() {
            let expected = resample_gpu(whole, &scene.volume, &scene.warp(), &quiet).unwrap();
            assert_ne!(expected.0, scene.volume, "control: {} changes something", scene.name);
            for (gpu, slab) in [(&tiny, 1), (&odd, 2), (&baseline, 5), (&baseline, 1000)] {
                let options =
                    ResamplerOptions { slab_slices: Some(slab), ..ResamplerOptions::centered(&scene.warp()) };
                let mut resampler = ResamplerGpu::new(gpu, &scene.volume, &scene.warp(), &options).unwrap();
                resampler.resample(&scene.deformed).unwrap();
                assert_eq!(resampler.slabs(), scene.volume.grid().shape[2].div_ceil(slab));
                let found = (resampler.volume(&quiet).unwrap(), resampler.report().unwrap());
                assert!(found == expected, "{} in slabs of {slab}", scene.name);
            }
        }
    });
}

#[test]
fn device_positions_need_no_readback_and_each_result_is_independent() {
    on_each_adapter(|gpu| {
        let scene = scenes::wave_with_shell_and_removed();
        let warp = scene.warp();
        let options = ResamplerOptions { offset: [0.007, -0.003, 0.011], ..ResamplerOptions::default() };
        let mut resampler = ResamplerGpu::new(gpu, &scene.volume, &warp, &options).unwrap();
        let on_device = |positions: &[Point3<f32>]| {
            let [x, y, z] = options.offset;
            let mut list: Vec<_> = positions.iter().map(|p| [p.x - x, p.y - y, p.z - z, 17.0]).collect();
            list.push([f32::NAN; 4]);
            gpu.buffer("positions", &list).unwrap()
        };
        let (deformed, rest) = (on_device(&scene.deformed), on_device(&scene.mesh.rest));
        let result =
            |resampler: &ResamplerGpu| (resampler.volume(&quiet).unwrap(), resampler.report().unwrap());

        let before = gpu.counters();
        resampler.resample_device(&deformed).unwrap();
        let after = gpu.counters();
        assert_eq!(after.readbacks, before.readbacks);
        assert_eq!(after.submits, before.submits + 1, "one submission for a slab");
        let first = result(&resampler);
        resampler.resample_device(&rest).unwrap();
        let at_rest = result(&resampler);
        assert_eq!(at_rest.1.moved_voxels, 0);
        assert_ne!(at_rest.0, first.0);
        resampler.resample(&scene.deformed).unwrap();
        assert!(result(&resampler) == first, "from the host");
        resampler.resample_device(&deformed).unwrap();
        assert!(result(&resampler) == first, "again on the device");
        resampler.slab_state(0).unwrap();
        assert!(result(&resampler) == first, "after reading the state of a slab");
    });
}

#[test]
fn a_tet_with_a_position_that_is_not_finite_holds_no_voxel() {
    on_each_adapter(|gpu| {
        let scene = scenes::half_at_rest();
        let options = ResamplerOptions::default();
        let mut resampler = ResamplerGpu::new(gpu, &scene.volume, &scene.warp(), &options).unwrap();
        let run = |resampler: &mut ResamplerGpu, broken: f32| {
            let mut list: Vec<_> = scene.mesh.rest.iter().map(|p| [p.x, p.y, p.z, 1.0]).collect();
            list[500][1] += broken;
            resampler.resample_device(&gpu.buffer("positions", &list).unwrap()).unwrap();
            resampler.report().unwrap()
        };
        let whole = run(&mut resampler, 0.0);
        assert_eq!((whole.moved_voxels, whole.vacated_voxels), (0, 0), "control");
        for broken in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let report = run(&mut resampler, broken);
            assert!(report.vacated_voxels > 0 && report.moved_voxels == 0, "{report:?}");
        }
    });
}

#[test]
fn invalid_input_is_refused() {
    on_each_adapter(|gpu| {
        let scene = scenes::padded();
        let mut resampler = resampler(gpu, &scene);
        let vertices = scene.deformed.len();
        let found = resampler.resample(&scene.deformed[1..]).unwrap_err();
        assert!(matches!(found, ResampleError::VertexCount { rest, .. } if rest == vertices), "{found}");
        let mut broken = scene.deformed.clone();
        broken[5].y = f32::NAN;
        let found = resampler.resample(&broken).unwrap_err();
        assert!(matches!(found, ResampleError::NotFinite { which: "deformed", vertex: 5, .. }), "{found}");
        let few = gpu.buffer("positions", &[[0.0; 4]; 3]).unwrap();
        let found = resampler.resample_device(&few).unwrap_err();
        assert!(matches!(found, ResampleError::VertexCount { deformed: 3, .. }), "{found}");
        let found = resampler.slab_state(1).unwrap_err();
        assert!(matches!(found, ResampleError::NoSuchSlab { slab: 1, slabs: 1 }), "{found}");
        let new = |options: ResamplerOptions| {
            ResamplerGpu::new(gpu, &scene.volume, &scene.warp(), &options).err().unwrap()
        };
        let found = new(ResamplerOptions { offset: [0.0, f32::NAN, 0.0], ..Default::default() });
        assert!(matches!(found, ResampleError::NotFinite { which: "offset", .. }), "{found}");
    });
}

#[test]
fn a_lost_device_is_an_error() {
    on_each_adapter(|gpu| {
        let scene = scenes::padded();
        let mut resampler = resampler(gpu, &scene);
        resampler.resample(&scene.deformed).unwrap();
        assert!(resampler.bytes() > (2 + 2 + 4) * scene.volume.voxels().len() as u64);
        gpu.lose();
        let lost = |found: ResampleError| matches!(found, ResampleError::Gpu(GpuError::Lost { .. }));
        assert!(lost(resampler.resample(&scene.deformed).unwrap_err()));
        assert!(lost(resampler.volume(&quiet).unwrap_err()));
        assert!(lost(resampler.report().unwrap_err()));
    });
}
