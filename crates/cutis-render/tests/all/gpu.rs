//! Pictures by a GPU compared with those by the CPU, with controls that must differ.

use cutis_gpu::{Gpu, GpuError, GpuOptions, Select};
use cutis_render::{
    Focus, GpuRaymarcher, Image, RenderError, Side, View, raymarch, raymarch_gpu, skin_depth,
};
use cutis_test_kit::gpu::{on_each_adapter, on_each_adapter_with};
use cutis_test_kit::scans;
use cutis_volume::phantom::Phantom;
use cutis_volume::{Affine, Grid, Volume, nifti};
use nalgebra::Point3;

/// Difference of two pictures over all pixels and channels, of 255.
#[derive(Debug)]
struct Difference {
    /// Mean of the absolute difference.
    mean: f64,
    /// Fraction of pixels with a difference of more than 8 in a channel.
    far: f64,
}

impl Difference {
    /// The limits for single precision: more than twice the differences on Mesa's software driver,
    /// where two pixels of a picture have ties.
    const ALLOWED: Self = Self { mean: 0.005, far: 0.0005 };

    fn between(a: &Image, b: &Image) -> Self {
        assert_eq!((a.width, a.height), (b.width, b.height));
        let apart: Vec<u8> = a.rgb.iter().zip(&b.rgb).map(|(a, b)| a.abs_diff(*b)).collect();
        let sum: u64 = apart.iter().map(|&d| u64::from(d)).sum();
        let far = apart.chunks_exact(3).filter(|pixel| pixel.iter().any(|&d| d > 8)).count();
        Self { mean: sum as f64 / apart.len() as f64, far: far as f64 / (apart.len() / 3) as f64 }
    }

    fn is_allowed(&self) -> bool {
        self.mean <= Self::ALLOWED.mean && self.far <= Self::ALLOWED.far
    }

    /// Difference between a view drawn by the GPU and a view drawn by the CPU.
    fn of(gpu: &Gpu, by_gpu: (&Volume, &View<'_>), by_cpu: (&Volume, &View<'_>)) -> Self {
        let picture = raymarch_gpu(gpu, by_gpu.0, by_gpu.1).unwrap();
        Self::between(&picture, &raymarch(by_cpu.0, by_cpu.1).unwrap())
    }
}

fn volume(grid: Grid, hu: impl Fn(Point3<f64>) -> f64) -> Volume {
    let voxels = (0..grid.len()).map(|v| hu(grid.mm(grid.point(v))) as i16).collect();
    Volume::new(grid, voxels, 1.0, 0.0).unwrap()
}

/// A phantom with voxels of 5 × 5 × 6 mm, without and with an open incision, and the depth of its
/// tissue at rest.
struct Person {
    whole: Volume,
    wounded: Volume,
    depth: Volume,
    site: Focus,
}

impl Person {
    fn new() -> Self {
        let phantom = Phantom::new([80, 80, 50], 3).unwrap();
        let whole = phantom.volume().unwrap();
        let depth = skin_depth(&whole, -300.0, 4.0, 30.0, None).unwrap();
        let (from, to) = phantom.incision_site();
        let middle = std::array::from_fn(|axis| (from[axis] + to[axis]) / 2.0);
        // A boat-shaped groove, 25 mm to either side at the skin and 30 mm deep.
        let hu = |v: usize| {
            let p = whole.grid().mm(whole.grid().point(v)) - Point3::from(middle);
            let open = p.x.abs() / 25.0 + (p.z / 60.0).powi(2) - p.y / 30.0 < 1.0;
            if open { -1000 } else { whole.voxels()[v] }
        };
        let wounded =
            Volume::new(*whole.grid(), (0..whole.grid().len()).map(hu).collect(), 1.0, 0.0).unwrap();
        Self { wounded, depth, site: Focus { center_mm: middle, size_mm: 180.0 }, whole }
    }

    /// A view of the incision. The skin is as thick as a voxel, so that some of it is visible.
    fn wound(&self) -> View<'_> {
        View { depth: Some(&self.depth), focus: Some(self.site), skin_mm: 5.0, ..plain(TURNED) }
    }
}

/// From the front, turned towards the patient's right.
const TURNED: Side = Side::From([0.4, 1.0, 0.3]);

/// `TURNED`, rotated about the body's axis.
fn turned_by(degrees: f64) -> Side {
    let (sin, cos) = degrees.to_radians().sin_cos();
    Side::From([0.4 * cos + sin, cos - 0.4 * sin, 0.3])
}

fn plain(side: Side) -> View<'static> {
    View { width: 120, height: 100, annotate: false, ..View::new(side) }
}

fn assert_same(gpu: &Gpu, cases: &[(&str, &Volume, View<'_>)]) {
    for (name, volume, view) in cases {
        let difference = Difference::of(gpu, (volume, view), (volume, view));
        eprintln!("{name}: {difference:?}");
        assert!(difference.is_allowed(), "{name}: {difference:?}");
    }
}

#[test]
fn a_person_looks_the_same() {
    on_each_adapter(|gpu| {
        let person = Person::new();
        let whole = &person.whole;
        let cases = [
            ("anterior", whole, plain(Side::Anterior)),
            ("from above", whole, plain(Side::Superior)),
            ("letters and scale", whole, View { annotate: true, ..plain(Side::Left) }),
            ("another threshold", whole, View { threshold_hu: 150.0, ..plain(TURNED) }),
            ("no occlusion", whole, View { occlusion_mm: 0.0, ..plain(TURNED) }),
            ("one ray per pixel", whole, View { samples: 1, ..plain(TURNED) }),
            ("up to sixteen rays per pixel", whole, View { samples: 4, ..plain(TURNED) }),
        ];
        assert_same(gpu, &cases);
    });
}

#[test]
fn a_wound_looks_the_same() {
    on_each_adapter(|gpu| {
        let person = Person::new();
        let wound = person.wound();
        // The same depths on a coarser grid with other axes.
        let rows = [
            [0.0, 9.0, -3.0, -200.0],
            [7.0, 1.0, 0.0, -230.0],
            [1.0, 0.0, 12.0, -260.0],
            [0.0, 0.0, 0.0, 1.0],
        ];
        let grid = Grid { shape: [60, 60, 50], affine: Affine::from_rows(rows).unwrap() };
        let depth_at =
            |v: usize| person.depth.trilinear(person.depth.grid().affine.to_index(grid.mm(grid.point(v))));
        let coarse = (0..grid.len()).map(|v| (50.0 * depth_at(v) + 200.0) as i16).collect();
        let coarse = Volume::new(grid, coarse, 0.02, -4.0).unwrap();
        let cases = [
            ("depth on another grid", &person.wounded, View { depth: Some(&coarse), ..wound }),
            ("from the front", &person.wounded, View { side: Side::Anterior, ..wound }),
            ("turned", &person.wounded, wound),
            ("the whole body", &person.wounded, View { focus: None, ..wound }),
            ("thin skin", &person.wounded, View { skin_mm: 0.5, ..wound }),
        ];
        assert_same(gpu, &cases);
    });
}

#[test]
fn unusual_volumes_look_the_same() {
    on_each_adapter(|gpu| {
        // Left-handed, sheared and anisotropic grids, incomplete blocks at the sides, padding, a
        // negative slope.
        let rows =
            [[-0.9, 0.3, 0.2, 15.0], [-0.2, -1.2, 0.0, 35.0], [0.0, 0.1, 2.0, -30.0], [0.0, 0.0, 0.0, 1.0]];
        let grid = Grid { shape: [50, 41, 30], affine: Affine::from_rows(rows).unwrap() };
        let padded = volume(grid, |p| match p.coords.norm() {
            r if r > 28.0 => -3024.0,
            r => (-300.0 - 400.0 * (r - 18.0)).clamp(-1000.0, 40.0),
        });
        let stored = padded.voxels().iter().map(|v| (v - 100) / -2).collect();
        let scaled = Volume::new(grid, stored, -2.0, 100.0).unwrap();
        // Faces on voxel planes that are seen along them, a surface in every cell, a single voxel.
        let grid = Grid { shape: [33; 3], affine: Affine::from_spacing([1.0; 3], [-16.0; 3]).unwrap() };
        let cube = volume(grid, |p| if p.coords.amax() < 10.0 { 300.0 } else { -1000.0 });
        let chequered = volume(grid, |p| if (p.x + p.y + p.z) as i32 % 5 == 0 { 400.0 } else { -1000.0 });
        let one = Grid { shape: [1; 3], affine: Affine::from_spacing([2.0; 3], [0.0; 3]).unwrap() };
        let dot = volume(one, |_| 40.0);
        let cases = [
            ("padded", &padded, plain(TURNED)),
            ("scaled", &scaled, plain(Side::Right)),
            ("cube along its faces", &cube, plain(Side::Posterior)),
            ("cube", &cube, plain(TURNED)),
            ("chequered", &chequered, plain(TURNED)),
            ("dot", &dot, plain(Side::Left)),
        ];
        assert_same(gpu, &cases);
    });
}

#[test]
fn a_real_scan_looks_the_same() {
    let Some(path) = scans::find("ct/leg_sts013_64x55x58.nii.gz") else { return };
    on_each_adapter(|gpu| {
        let leg = nifti::read(&path).unwrap().volume;
        let depth = skin_depth(&leg, -300.0, 4.0, 20.0, None).unwrap();
        let bare = View { depth: Some(&depth), threshold_hu: 0.0, ..plain(Side::Posterior) };
        assert_same(gpu, &[("skin", &leg, plain(TURNED)), ("without its skin", &leg, bare)]);
    });
}

/// Each control changes one setting of the GPU's picture, which must then differ from the CPU's.
#[test]
fn other_views_are_detected() {
    on_each_adapter(|gpu| {
        let person = Person::new();
        let (skin, wound) = (plain(TURNED), person.wound());
        let shifted = Focus { size_mm: 1.01 * person.site.size_mm, ..person.site };
        let controls = [
            (
                "no change, as a control of the controls",
                false,
                &person.whole,
                skin,
                View { side: turned_by(0.0), ..skin },
            ),
            ("turned by 1 degree", true, &person.whole, skin, View { side: turned_by(1.0), ..skin }),
            ("threshold 1 HU higher", true, &person.whole, skin, View { threshold_hu: -299.0, ..skin }),
            ("occlusion 1 mm shorter", true, &person.whole, skin, View { occlusion_mm: 11.0, ..skin }),
            ("fewer rays at edges", true, &person.whole, skin, View { samples: 1, ..skin }),
            ("a hundredth smaller", true, &person.wounded, wound, View { focus: Some(shifted), ..wound }),
            (
                "skin 0.1 mm thicker",
                true,
                &person.wounded,
                wound,
                View { skin_mm: wound.skin_mm + 0.1, ..wound },
            ),
            ("no depth", true, &person.wounded, wound, View { depth: None, ..wound }),
        ];
        for (name, differs, volume, view, changed) in controls {
            let difference = Difference::of(gpu, (volume, &changed), (volume, &view));
            eprintln!("{name}: {difference:?}");
            assert_eq!(!difference.is_allowed(), differs, "{name}: {difference:?}");
        }
    });
}

#[test]
fn a_raymarcher_serves_many_views_from_one_upload() {
    on_each_adapter(|gpu| {
        let person = Person::new();
        let wound = View { width: 60, height: 50, ..person.wound() };
        let views = [
            View { depth: None, ..wound },
            wound,
            View { side: Side::Anterior, threshold_hu: 0.0, ..wound },
            View { side: Side::Left, depth: None, ..wound },
        ];
        let mut raymarcher = GpuRaymarcher::new(gpu, &person.wounded).unwrap();
        for view in &views {
            let picture = raymarcher.render(view).unwrap();
            assert_eq!(picture, raymarch_gpu(gpu, &person.wounded, view).unwrap());
        }
        let before = gpu.counters();
        for view in &views {
            raymarcher.render(&View { samples: 1, ..*view }).unwrap();
        }
        let after = gpu.counters();
        let created = |count: cutis_gpu::Counters| (count.kernels, count.textures, count.buffers);
        assert_eq!(created(after), created(before));
        assert_eq!(after.readbacks - before.readbacks, 8, "two for each picture: every second pixel, others");
        // Another depth volume replaces the first one.
        let shallow = vec![100; person.depth.voxels().len()];
        let shallow = Volume::new(*person.depth.grid(), shallow, person.depth.slope(), 0.0).unwrap();
        let flat = View { depth: Some(&shallow), ..wound };
        let deep = raymarcher.render(&wound).unwrap();
        assert_ne!(raymarcher.render(&flat).unwrap(), deep);
        assert_eq!(raymarcher.render(&flat).unwrap(), raymarch_gpu(gpu, &person.wounded, &flat).unwrap());
        assert_eq!(gpu.counters().texture_bytes, before.texture_bytes);
        assert_eq!(raymarcher.render(&wound).unwrap(), deep);
    });
}

#[test]
fn chunks_and_baseline_limits_change_no_bit() {
    on_each_adapter(|gpu| {
        let person = Person::new();
        let view = View { width: 50, height: 40, ..person.wound() };
        let picture = raymarch_gpu(gpu, &person.wounded, &view).unwrap();
        for chunk_cap in [None, Some(100), Some(1999)] {
            let options = GpuOptions {
                select: Select::Index(gpu.adapter().index),
                chunk_cap,
                baseline_limits: true,
                ..GpuOptions::default()
            };
            let capped = Gpu::open(&options).unwrap();
            assert_eq!(raymarch_gpu(&capped, &person.wounded, &view).unwrap(), picture, "{chunk_cap:?}");
            let dispatches = capped.counters().dispatches;
            assert!(
                chunk_cap.is_none_or(|cap| dispatches > (2000 / cap) as u64),
                "{dispatches} for {chunk_cap:?}"
            );
        }
    });
}

#[test]
fn invalid_views_are_refused_as_on_the_cpu() {
    let options = GpuOptions { baseline_limits: true, ..GpuOptions::default() };
    on_each_adapter_with(&options, |gpu| {
        let grid = |shape| Grid { shape, affine: Affine::from_spacing([1.0; 3], [-9.5; 3]).unwrap() };
        let ball = volume(grid([20; 3]), |p| if p.coords.norm() < 6.0 { 40.0 } else { -1000.0 });
        let good = View { width: 20, height: 20, ..View::new(Side::Anterior) };
        let bad = [
            View { width: 0, ..good },
            View { width: usize::MAX, height: 2, ..good },
            View { threshold_hu: f32::NAN, ..good },
            View { samples: 5, ..good },
            View { skin_mm: 0.0, ..good },
            View { occlusion_mm: f64::INFINITY, ..good },
            View { side: Side::From([0.0; 3]), ..good },
            View { focus: Some(Focus { center_mm: [0.0; 3], size_mm: -1.0 }), ..good },
        ];
        for view in bad {
            let [by_gpu, by_cpu] = [raymarch_gpu(gpu, &ball, &view), raymarch(&ball, &view)];
            assert_eq!(by_gpu.unwrap_err().to_string(), by_cpu.unwrap_err().to_string());
        }
        let long = volume(grid([2049, 1, 1]), |_| 0.0);
        let error = raymarch_gpu(gpu, &long, &good).unwrap_err();
        assert!(matches!(error, RenderError::Gpu(GpuError::Limit { needed: 2049, .. })), "{error}");
    });
}

#[test]
fn extreme_numbers_give_a_picture() {
    on_each_adapter(|gpu| {
        let grid = Grid { shape: [20; 3], affine: Affine::from_spacing([1.0; 3], [-9.5; 3]).unwrap() };
        let ball = volume(grid, |p| if p.coords.norm() < 6.0 { 40.0 } else { -1000.0 });
        let view = View { width: 20, height: 20, annotate: false, ..View::new(TURNED) };
        let far = |size_mm| Some(Focus { center_mm: [4e300, 1e301, 3e300], size_mm });
        let near = Some(Focus { center_mm: [0.0; 3], size_mm: 1e-300 });
        let same = [
            ("far", View { focus: far(1.0), ..view }),
            ("far and wide", View { focus: far(1e300), ..view }),
            ("near", View { focus: near, ..view }),
            ("far occlusion", View { occlusion_mm: 1e300, ..view }),
            ("short occlusion", View { occlusion_mm: 1e-300, ..view }),
            ("nothing is solid", View { threshold_hu: f32::MAX, ..view }),
            ("all is solid", View { threshold_hu: f32::MIN, ..view }),
            ("nearly along an axis", View { side: Side::From([1e-40, 1.0, -1e-12]), ..view }),
        ];
        assert_same(gpu, &same.map(|(name, view)| (name, &ball, view)));
        for scale in [1e-60, 1e60] {
            let affine = Affine::from_spacing([scale; 3], [-9.5 * scale; 3]).unwrap();
            let ball = Volume::new(Grid { affine, ..grid }, ball.voxels().to_vec(), 1.0, 0.0).unwrap();
            let view = View { occlusion_mm: 0.0, ..view };
            assert_same(gpu, &[("a grid of another size", &ball, view)]);
        }
        // The values exceed single precision. No picture is correct, but there is one.
        let bright = Volume::new(grid, ball.voxels().to_vec(), 3e38, 0.0).unwrap();
        assert!(raymarch_gpu(gpu, &bright, &view).is_ok());
    });
}

#[test]
fn a_lost_device_is_an_error() {
    on_each_adapter(|gpu| {
        let grid = Grid { shape: [9; 3], affine: Affine::from_spacing([1.0; 3], [0.0; 3]).unwrap() };
        let volume = volume(grid, |_| 0.0);
        let view = View { width: 9, height: 9, ..View::new(TURNED) };
        let mut raymarcher = GpuRaymarcher::new(gpu, &volume).unwrap();
        assert!(raymarcher.render(&view).is_ok());
        gpu.lose();
        for error in [raymarcher.render(&view).unwrap_err(), raymarch_gpu(gpu, &volume, &view).unwrap_err()] {
            assert!(matches!(error, RenderError::Gpu(GpuError::Lost { .. })), "{error}");
        }
    });
}
