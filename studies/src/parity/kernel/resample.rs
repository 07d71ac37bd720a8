//! One slab of a resampled volume: owners, marks, values and counts, against the scalar twin.
//!
//! On hardware, rounding may assign a voxel at a face to the neighboring tet, and change a value by
//! 1, so that a share of the voxels may differ. The volume is noise, so that a shift by a fiftieth
//! of a voxel changes nearly all of them.

use cutis_gpu::Gpu;
use cutis_resample::{ResamplerGpu, ResamplerOptions, SlabState, Warp};
use cutis_volume::{Affine, Grid, Volume};
use nalgebra::{Point3, Vector3};

use crate::parity::bench::{Bench, Failure};
use crate::parity::comparison::{Figures, Measured, Ring};
use crate::parity::difference::Policy;
use cutis_test_kit::Kuhn;

/// Slices of the slab.
const SLAB: usize = 9;
/// The compared slab.
const NUMBER: usize = 1;
/// Largest share of voxels with another owner or value on hardware.
const SHARE: f64 = 1e-3;
/// Voxel size in mm.
const VOXEL_MM: [f64; 3] = [0.9765625, 0.7, 1.1];

struct Scene {
    volume: Volume,
    rest: Vec<Point3<f32>>,
    deformed: Vec<Point3<f32>>,
    tets: Vec<[u32; 4]>,
    removed: Vec<[u32; 4]>,
}

pub fn run(bench: &mut Bench<'_, '_>) -> Result<(), Failure> {
    let name = "resample: one slab";
    let scene = Scene::new()?;
    let options = ResamplerOptions { slab_slices: Some(SLAB), ..ResamplerOptions::centered(&scene.warp()) };
    let expected = cutis_resample_twin::resample_slab(
        &scene.volume,
        &scene.warp(),
        &options,
        NUMBER * SLAB..(NUMBER + 1) * SLAB,
    )?;
    let measure = |gpu: &Gpu, policy, deformed: &[Point3<f32>]| {
        let mut resampler = ResamplerGpu::new(gpu, &scene.volume, &scene.warp(), &options)?;
        resampler.resample(deformed)?;
        Ok(compared(&resampler.slab_state(NUMBER)?, &expected, policy))
    };
    bench.compare(Ring::Kernel, name, |gpu, policy| measure(gpu, policy, &scene.deformed))?;
    for (what, shift_voxels) in [("shifted by 0.02 voxels", 0.02), ("shifted by 0.5 voxels", 0.5)] {
        let shift = (shift_voxels * VOXEL_MM[0] * 1e-3) as f32;
        let shifted: Vec<_> = scene.deformed.iter().map(|p| p + Vector3::new(shift, 0.0, 0.0)).collect();
        bench.control(Ring::Kernel, name, what, |gpu, policy| measure(gpu, policy, &shifted))?;
    }
    Ok(())
}

/// Compares owners and values. On hardware a value may differ by 1, and a count by the allowed
/// share of all voxels.
fn compared(found: &SlabState, expected: &SlabState, policy: Policy) -> Measured {
    let least = if policy == Policy::Exact { 1 } else { 2 };
    let voxels = expected.owners.len().max(found.owners.len());
    let pairs = found.owners.iter().zip(&expected.owners).zip(found.values.iter().zip(&expected.values));
    let equal = pairs.filter(|((a, b), (x, y))| a == b && x.abs_diff(**y) < least).count();
    let rest = found.marks == expected.marks && found.counts == expected.counts;
    let differing = (voxels - equal) as u64;
    let worst = differing as f64 / voxels as f64;
    let most = (SHARE * voxels as f64) as u32;
    let counts_near = found.counts.iter().zip(&expected.counts).all(|(a, b)| a.abs_diff(*b) <= most);
    let (agrees, tolerance) = match policy {
        Policy::Exact => (differing == 0 && rest, 0.0),
        Policy::Within(_) => (worst <= SHARE && counts_near, SHARE),
    };
    let figures = Figures { compared: voxels as u64, differing, worst, tolerance, of: "all voxels" };
    Measured::new(agrees, figures)
}

impl Scene {
    /// Noise, and a bent lattice without a few tets.
    fn new() -> Result<Self, Failure> {
        let affine = Affine::from_spacing(VOXEL_MM, [-13.0, 4.0, 100.0 / 3.0])?;
        let grid = Grid { shape: [37, 41, 29], affine };
        let noise = |n: usize| (n.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40 & 0x7ff) as i16 - 1000;
        let volume = Volume::new(grid, (0..grid.len()).map(noise).collect(), 1.0, 0.0)?;
        let Kuhn { positions, mut tets, .. } = Kuhn::new([8, 7, 6], 1.0);
        let place = |p: &Point3<f64>| {
            let voxels = Vector3::new(2.3 + 4.4 * p.x, 3.1 + 5.2 * p.y, 1.7 + 4.6 * p.z);
            Point3::from(voxels.component_mul(&Vector3::from(VOXEL_MM)) * 1e-3)
        };
        let bent = |p: Point3<f64>| p + Vector3::new(0.002, 0.001, 0.003) * (150.0 * p.y).sin();
        let rest: Vec<_> = positions.iter().map(|p| place(p).map(|c| c as f32)).collect();
        let deformed = positions.iter().map(|p| bent(place(p)).map(|c| c as f32)).collect();
        let removed = tets.drain(400..430).collect();
        Ok(Self { volume, rest, deformed, tets, removed })
    }

    fn warp(&self) -> Warp<'_> {
        Warp {
            origin_mm: self.volume.grid().affine.to_mm(Point3::origin()),
            rest: &self.rest,
            deformed: &self.deformed,
            tets: &self.tets,
            body_tets: self.tets.len() - 100,
            removed: &self.removed,
        }
    }
}
