//! The kernels compared with plain Rust in single precision: the march without blocks, sample by
//! sample and bit for bit on exact adapters, and the largest values of blocks. Also a control of
//! the light.

use cutis_gpu::{GpuOptions, Select};
use cutis_test_kit::gpu::{is_exact, on_each_adapter};
use cutis_volume::{Affine, Grid, phantom::Phantom};
use nalgebra::Vector3;

use super::scene::block_shape;
use super::uniform::single;
use super::*;
use crate::Side;
use crate::shade::encode;

/// The same operations as `march.wgsl` and `field.wgsl`.
struct Twin<'a> {
    field: &'a Field<'a>,
    step: Vector3<f32>,
    threshold_hu: f32,
    halvings: usize,
}

impl Twin<'_> {
    fn hu_at(&self, position: Vector3<f32>) -> f32 {
        let shape = self.field.shape();
        let last = Vector3::from(shape.map(|n| (n - 1) as f32));
        let inside = position.zip_map(&last, |x, last| x.max(0.0).min(last));
        let whole = inside.map(f32::floor);
        let part = inside - whole;
        let voxel = |corner: usize| {
            let at = |axis: usize| (whole[axis] as usize + (corner >> axis & 1)).min(shape[axis] - 1);
            self.field.voxel(at(0) + shape[0] * (at(1) + shape[1] * at(2)))
        };
        let row = [0, 2, 4, 6].map(|n| voxel(n) + part.x * (voxel(n + 1) - voxel(n)));
        let near = row[0] + part.y * (row[1] - row[0]);
        let far = row[2] + part.y * (row[3] - row[2]);
        near + part.z * (far - near)
    }

    /// Number of steps to the surface; −1 if there is none.
    fn march(&self, [x, y, z, length]: [f32; 4]) -> f32 {
        let is_inside = |n: f32| self.hu_at(Vector3::new(x, y, z) + self.step * n) >= self.threshold_hu;
        let mut n = 0.0;
        while n <= length {
            if is_inside(n) {
                let (mut outside, mut inside) = (n - 1.0, n);
                for _ in 0..if n == 0.0 { 0 } else { self.halvings } {
                    let middle = (outside + inside) * 0.5;
                    if is_inside(middle) { inside = middle } else { outside = middle }
                }
                return inside;
            }
            n += 1.0;
        }
        -1.0
    }
}

/// Steps to the surface along the rays of a view, by the device and by the twin.
fn both(raymarcher: &mut GpuRaymarcher<'_>, view: &View<'_>, halvings: usize) -> (Vec<f32>, Vec<f32>) {
    let axes = Axes::new(view.side).unwrap();
    let field = Field::new(raymarcher.volume);
    let rays = Rays::new(&field, view, &axes);
    let shader = Shader::new(&field, view, &axes);
    let places = (0..view.width * view.height)
        .map(|pixel| [(pixel % view.width) as f64 + 0.5, (pixel / view.width) as f64 + 0.5]);
    let starts: Vec<_> = places.map(|place| start(&rays, place)).collect();
    let found = trace(raymarcher, view, &rays, &shader, &starts);
    let twin = Twin { field: &field, step: rays.step.map(single), threshold_hu: view.threshold_hu, halvings };
    let steps = starts.par_iter().map(|&start| twin.march(start)).collect();
    (found.iter().map(|found| found[3]).collect(), steps)
}

fn trace(
    raymarcher: &mut GpuRaymarcher<'_>,
    view: &View<'_>,
    rays: &Rays<'_>,
    shader: &Shader<'_>,
    starts: &[[f32; 4]],
) -> Vec<[f32; 4]> {
    let uniform = ViewUniform::new(raymarcher.volume, view, rays, shader);
    let GpuRaymarcher { gpu, scene, kernels, .. } = raymarcher;
    let (kernel, depth) = kernels.of(gpu, None).unwrap();
    scene.look(gpu, &uniform).unwrap();
    scene.trace(gpu, kernel, depth, starts).unwrap()
}

/// Volumes with and without incomplete blocks at their sides.
fn volumes() -> Vec<Volume> {
    let grid = Grid {
        shape: [33, 20, 41],
        affine: Affine::from_rows([
            [-0.9, 0.5, 0.0, 8.0],
            [0.3, 1.2, 0.2, -20.0],
            [0.0, 0.1, 0.7, -15.0],
            [0.0, 0.0, 0.0, 1.0],
        ])
        .unwrap(),
    };
    // Single bright voxels in noise and padding, which rays may graze, up to a wall between blocks.
    // The blocks behind the wall are empty.
    let crumb = |v: usize| match (v.wrapping_mul(0x9e37_79b9) >> 9) % 1009 {
        0..16 if grid.point(v)[0] < 24 => 1000,
        noise @ 0..500 => noise as i16 - 1000,
        _ => -3024,
    };
    let crumbs = Volume::new(grid, (0..grid.len()).map(crumb).collect(), 0.5, -100.0).unwrap();
    vec![Phantom::new([48, 40, 57], 5).unwrap().volume().unwrap(), crumbs]
}

const VIEW: View<'_> = View {
    side: Side::From([0.5, 1.0, 0.3]),
    width: 72,
    height: 60,
    threshold_hu: -300.0,
    focus: None,
    depth: None,
    skin_mm: 2.0,
    occlusion_mm: 12.0,
    samples: 1,
    annotate: false,
};

#[test]
fn rays_meet_the_surface_where_the_twin_does() {
    on_each_adapter(|gpu| {
        let exact = is_exact(gpu);
        // Software adapters give the same bits. On others two refinements may differ, and one ray
        // in a hundred may graze something.
        let apart = |found: &[f32], twin: &[f32]| {
            let differs = |(a, b): &(&f32, &f32)| {
                if exact { a.to_bits() != b.to_bits() } else { (**a - **b).abs() > 1.0 / 32.0 }
            };
            let count = found.iter().zip(twin).filter(differs).count();
            if exact { count > 0 } else { 100 * count > found.len() }
        };
        for (number, volume) in volumes().iter().enumerate() {
            let mut raymarcher = GpuRaymarcher::new(gpu, volume).unwrap();
            let mut both = |view: &View<'_>, halvings| both(&mut raymarcher, view, halvings);
            for side in [VIEW.side, Side::Anterior, Side::Superior, Side::From([-1.0, -0.2, 0.01])] {
                let (found, twin) = both(&View { side, ..VIEW }, 6);
                let hits = twin.iter().filter(|n| **n > 0.0).count();
                assert!(hits > 100, "only {hits} rays meet volume {number} from {side:?}");
                assert!(!apart(&found, &twin), "volume {number} from {side:?}");
            }
            // Controls: a threshold that is 20 HU off, and a coarser refinement.
            let (found, twin) = both(&VIEW, 6);
            let (moved, _) = both(&View { threshold_hu: -280.0, ..VIEW }, 6);
            let (_, coarse) = both(&VIEW, 3);
            assert!(apart(&moved, &twin) && apart(&found, &coarse), "volume {number}: the controls agree");
        }
    });
}

#[test]
fn blocks_hold_their_largest_value() {
    on_each_adapter(|gpu| {
        // The second device has fewer threads than there are blocks.
        let select = Select::Index(gpu.adapter().index);
        let capped = Gpu::open(&GpuOptions { select, chunk_cap: Some(10), ..GpuOptions::default() }).unwrap();
        for volume in volumes() {
            let field = Field::new(&volume);
            let (voxels, blocks) = (field.shape(), block_shape(field.shape()));
            let mut expected = vec![f32::NEG_INFINITY; blocks.iter().product()];
            for v in 0..volume.grid().len() {
                let at = volume.grid().point(v);
                // The blocks whose 9 × 9 × 9 voxels include this one.
                let of = |axis: usize| {
                    (0..blocks[axis]).filter(move |block| (8 * block..=8 * block + 8).contains(&at[axis]))
                };
                for k in of(2) {
                    for j in of(1) {
                        for i in of(0) {
                            let largest = &mut expected[i + blocks[0] * (j + blocks[1] * k)];
                            *largest = largest.max(field.voxel(v));
                        }
                    }
                }
            }
            for gpu in [gpu, &capped] {
                let raymarcher = GpuRaymarcher::new(gpu, &volume).unwrap();
                let found = gpu.read(&raymarcher.scene.largest, 0..expected.len()).unwrap();
                assert_eq!(found, expected, "{voxels:?}");
            }
            assert!(
                expected.iter().any(|hu| *hu < VIEW.threshold_hu),
                "no block of {voxels:?} can be skipped"
            );
        }
    });
}

/// A control of the comparison of pictures that no view can set: light from another direction, by
/// 1°.
#[test]
fn light_from_another_direction_is_detected() {
    on_each_adapter(|gpu| {
        let volume = &volumes()[0];
        let (axes, field) = (Axes::new(VIEW.side).unwrap(), Field::new(volume));
        let rays = Rays::new(&field, &VIEW, &axes);
        let mut shader = Shader::new(&field, &VIEW, &axes);
        let starts: Vec<_> = (0..60).map(|y| start(&rays, [36.0, f64::from(y)])).collect();
        let mut raymarcher = GpuRaymarcher::new(gpu, volume).unwrap();
        let mut colors = |turn: f64| {
            shader.light = (shader.light + axes.right * turn).normalize();
            let found = trace(&mut raymarcher, &VIEW, &rays, &shader, &starts);
            found.iter().flat_map(|&[r, g, b, _]| encode(Light::new(r, g, b))).collect::<Vec<u8>>()
        };
        let (first, same, turned) = (colors(0.0), colors(0.0), colors(1f64.to_radians()));
        assert_eq!(first, same);
        let mean = first.iter().zip(&turned).map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>()
            / first.len() as f64;
        assert!(mean > 0.1, "{mean}");
    });
}
