//! Geometry, gray levels, files and limits of pictures.

use cutis_render::{
    Axes, Contour, Focus, Image, Plane, RenderError, Side, SliceView, View, raymarch, side_by_side, slice,
};
use cutis_volume::{Affine, Grid, Volume};
use nalgebra::{Point3, Vector3};

/// Grids of 40 mm cubes around the origin, stored along different axes of the patient.
fn grids() -> Vec<(&'static str, Grid)> {
    let place = |name, columns: [[f64; 3]; 3], shape: [usize; 3]| {
        let middle: Vector3<f64> =
            (0..3).map(|axis| Vector3::from(columns[axis]) * (shape[axis] as f64 - 1.0) / 2.0).sum();
        let row = |r: usize| [columns[0][r], columns[1][r], columns[2][r], -middle[r]];
        let affine = Affine::from_rows([row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]).unwrap();
        (name, Grid { shape, affine })
    };
    let (s, c) = 0.2_f64.sin_cos();
    vec![
        place("RAS", [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], [40; 3]),
        place("LPS", [[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 2.0]], [40, 40, 20]),
        place("PIR", [[0.0, -1.0, 0.0], [0.0, 0.0, -2.0], [1.0, 0.0, 0.0]], [40, 20, 40]),
        place("oblique", [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]], [40; 3]),
    ]
}

fn volume(grid: Grid, hu: impl Fn(Point3<f64>) -> f64) -> Volume {
    let voxels = (0..grid.len()).map(|v| hu(grid.mm(grid.point(v))) as i16).collect();
    Volume::new(grid, voxels, 1.0, 0.0).unwrap()
}

/// Mean position of the bright pixels relative to the center of the picture, to the right and
/// upwards.
fn centroid(image: &Image, is_bright: impl Fn([u8; 3]) -> bool) -> [f64; 2] {
    let (mut sum, mut count) = ([0.0; 2], 0.0);
    for y in 0..image.height {
        for x in 0..image.width {
            if is_bright(image.pixel(x, y).unwrap()) {
                sum[0] += x as f64 + 0.5 - image.width as f64 / 2.0;
                sum[1] += image.height as f64 / 2.0 - y as f64 - 0.5;
                count += 1.0;
            }
        }
    }
    assert!(count > 0.0, "nothing is bright");
    sum.map(|s| s / count)
}

const MARKS: [(&str, [f64; 3]); 6] = [
    ("R", [12.0, 0.0, 0.0]),
    ("L", [-12.0, 0.0, 0.0]),
    ("A", [0.0, 12.0, 0.0]),
    ("P", [0.0, -12.0, 0.0]),
    ("S", [0.0, 0.0, 12.0]),
    ("I", [0.0, 0.0, -12.0]),
];

/// The mark must be at the picture's own letter for its direction.
fn assert_at_letter(found: [f64; 2], letters: &[String; 4], mark: &str, context: &str) {
    let [left, right, top, bottom] = letters;
    let expected = match mark {
        _ if mark == left => [-12.0, 0.0],
        _ if mark == right => [12.0, 0.0],
        _ if mark == top => [0.0, 12.0],
        _ if mark == bottom => [0.0, -12.0],
        _ => [0.0, 0.0],
    };
    for axis in 0..2 {
        assert!(
            (found[axis] - expected[axis]).abs() < 1.0,
            "{context}, {mark}: {found:?}, expected {expected:?}"
        );
    }
}

#[test]
fn a_mark_appears_at_its_letter_from_every_side_and_for_every_orientation() {
    let sides = [Side::Anterior, Side::Posterior, Side::Left, Side::Right, Side::Superior, Side::Inferior];
    let expected = ["R L S I", "L R S I", "A P S I", "P A S I", "L R A P", "R L A P"];
    for (name, grid) in grids() {
        for (mark, at) in MARKS {
            let block = volume(grid, |p| if (p - Point3::from(at)).amax() < 4.0 { 300.0 } else { -1000.0 });
            for (side, letters) in sides.into_iter().zip(expected) {
                let focus = Some(Focus { center_mm: [0.0; 3], size_mm: 40.0 });
                let view = View { width: 40, height: 40, annotate: false, focus, ..View::new(side) };
                let image = raymarch(&block, &view).unwrap();
                let found = centroid(&image, |[r, _, _]| r > 80);
                let shown = Axes::new(side).unwrap().letters();
                assert_eq!(shown.join(" "), letters);
                assert_at_letter(found, &shown, mark, &format!("{name} from {side:?}"));
            }
        }
    }
}

#[test]
fn a_mark_appears_at_its_letter_in_every_slice() {
    let cases = [
        (Plane::Axial, true, "R L A P"),
        (Plane::Axial, false, "L R A P"),
        (Plane::Coronal, true, "R L S I"),
        (Plane::Coronal, false, "L R S I"),
        (Plane::Sagittal, true, "A P S I"),
        (Plane::Sagittal, false, "P A S I"),
    ];
    for (name, grid) in grids() {
        for (mark, at) in MARKS {
            let block = volume(grid, |p| if (p - Point3::from(at)).amax() < 4.0 { 300.0 } else { -1000.0 });
            for (plane, radiological, letters) in cases {
                let axis =
                    [Plane::Sagittal, Plane::Coronal, Plane::Axial].iter().position(|p| *p == plane).unwrap();
                let view = SliceView { radiological, annotate: false, ..SliceView::new(plane, at[axis]) };
                let found = centroid(&slice(&block, &view).unwrap(), |[r, _, _]| r > 128);
                let letters: Vec<String> = letters.split(' ').map(str::to_owned).collect();
                assert_at_letter(found, &letters.try_into().unwrap(), mark, &format!("{name} {plane:?}"));
            }
        }
    }
}

#[test]
fn window_and_level_are_exact() {
    let grid = Grid { shape: [7, 1, 1], affine: Affine::from_spacing([1.0; 3], [0.0; 3]).unwrap() };
    let values = vec![-3024, -160, -159, 40, 239, 240, 3000];
    let view = SliceView { annotate: false, radiological: false, ..SliceView::new(Plane::Axial, 0.0) };
    let image = slice(&Volume::new(grid, values.clone(), 1.0, 0.0).unwrap(), &view).unwrap();
    assert_eq!((image.width, image.height), (7, 1));
    let grays: Vec<u8> = (0..7).map(|x| image.pixel(x, 0).unwrap()[0]).collect();
    assert_eq!(grays, [0, 0, 1, 128, 254, 255, 255]);
    let scaled = Volume::new(grid, values.iter().map(|v| v / 2).collect(), 2.0, 0.0).unwrap();
    assert_eq!(slice(&scaled, &view).unwrap().pixel(3, 0), Some([128; 3]));
    let narrow = SliceView { window_hu: 2.0, level_hu: 239.5, ..view };
    assert_eq!(narrow.gray(239.5), 128);
    assert_eq!((narrow.gray(238.5), narrow.gray(240.5)), (0, 255));
}

/// Below the window the gray falls to black in air, and it has no jump. Without that all of it is
/// black.
#[test]
fn voxels_that_are_partly_air_can_be_shown() {
    let plain = SliceView::new(Plane::Axial, 0.0);
    let view = SliceView { edge_gray: 0.4, ..plain };
    let grays = [-2000.0, -1000.0, -580.0, -161.0, -160.0, 40.0, 240.0, 1000.0].map(|hu| view.gray(hu));
    assert_eq!(grays, [0, 0, 51, 102, 102, 179, 255, 255]);
    assert_eq!([-1000.0, -580.0, -161.0].map(|hu| plain.gray(hu)), [0; 3]);
    let volume = ball([2.0; 3], [20; 3], 10.0);
    for edge_gray in [-0.1, 1.0, f32::NAN] {
        let error = slice(&volume, &SliceView { edge_gray, ..plain }).unwrap_err();
        assert!(matches!(error, RenderError::Setting { key: "edge_gray", .. }), "{error}");
    }
}

#[test]
fn anisotropic_voxels_keep_their_aspect() {
    let grid = Grid { shape: [40, 30, 10], affine: Affine::from_spacing([1.0, 1.0, 5.0], [0.0; 3]).unwrap() };
    let image = slice(&volume(grid, |_| 0.0), &SliceView::new(Plane::Coronal, 3.0)).unwrap();
    assert_eq!((image.width, image.height), (40, 50));
    let view = SliceView { long_side: Some(500), ..SliceView::new(Plane::Coronal, 3.0) };
    let image = slice(&volume(grid, |_| 0.0), &view).unwrap();
    assert_eq!((image.width, image.height), (400, 500));
}

fn ball(spacing: [f64; 3], shape: [usize; 3], radius: f64) -> Volume {
    let origin = std::array::from_fn(|axis| -spacing[axis] * (shape[axis] as f64 - 1.0) / 2.0);
    let grid = Grid { shape, affine: Affine::from_spacing(spacing, origin).unwrap() };
    // The surface is at −300 HU, a third of the way from tissue to air.
    volume(grid, |p| (-300.0 - 400.0 * (p.coords.norm() - radius)).clamp(-1000.0, 40.0))
}

#[test]
fn a_ball_is_a_disc_of_its_radius_from_any_side() {
    let ball = ball([1.0, 1.0, 1.0], [60, 60, 60], 20.0);
    for side in [Side::Anterior, Side::Inferior, Side::Right, Side::From([1.0, -2.0, 0.7])] {
        for samples in [1, 2] {
            let focus = Some(Focus { center_mm: [0.0; 3], size_mm: 50.0 });
            let view = View { width: 200, height: 200, annotate: false, focus, samples, ..View::new(side) };
            let image = raymarch(&ball, &view).unwrap();
            let background = image.pixel(0, 0);
            let count = (0..200 * 200).filter(|p| image.pixel(p % 200, p / 200) != background).count();
            let radius = (count as f64 / std::f64::consts::PI).sqrt();
            assert!((radius - 80.0).abs() < 1.0, "radius {radius} pixels from {side:?}, expected 80");
        }
    }
}

#[test]
fn a_face_of_the_volume_shows_the_inside_in_gray() {
    let ball = ball([1.0; 3], [60; 3], 20.0);
    let view = View { width: 100, height: 100, annotate: false, ..View::new(Side::Anterior) };
    // The front half is missing, so that the ball reaches the anterior face of the volume.
    let grid = Grid { shape: [60, 30, 60], affine: ball.grid().affine };
    let half: Vec<i16> = (0..grid.len()).map(|v| ball.voxels()[ball.grid().index(grid.point(v))]).collect();
    let half = Volume::new(grid, half, 1.0, 0.0).unwrap();
    let [r, g, b] = raymarch(&half, &view).unwrap().pixel(50, 50).unwrap();
    assert!(r == g && g == b && r > 60, "the cut face is gray");
    let [r, _, b] = raymarch(&ball, &view).unwrap().pixel(50, 50).unwrap();
    assert!(r > b, "the skin is not gray");
}

#[test]
fn deep_tissue_is_colored_by_hu() {
    let ball = ball([1.0; 3], [60; 3], 20.0);
    let view = View { width: 50, height: 50, annotate: false, ..View::new(Side::Anterior) };
    let skin = raymarch(&ball, &view).unwrap().pixel(25, 25).unwrap();
    let depth = |mm: i16| Volume::new(*ball.grid(), vec![mm; ball.grid().len()], 1.0, 0.0).unwrap();
    let at = |depth: &Volume| {
        raymarch(&ball, &View { depth: Some(depth), ..view }).unwrap().pixel(25, 25).unwrap()
    };
    assert_eq!(at(&depth(1)), skin);
    let muscle = at(&depth(10));
    assert!(muscle[1] + 40 < skin[1] && muscle[0] > 100, "{muscle:?} is not red");
    // In voxels of 6 mm, tissue at 10 mm may be the second voxel below the skin.
    let affine = Affine::from_spacing([6.0; 3], [-30.0; 3]).unwrap();
    let coarse = |mm| Volume::new(Grid { shape: [11; 3], affine }, vec![mm; 1331], 1.0, 0.0).unwrap();
    assert_eq!(at(&coarse(10)), skin);
    assert_eq!(at(&coarse(30)), muscle);
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let ball = ball([1.0, 1.3, 2.0], [50, 40, 30], 15.0);
    let pictures = [1, 2, 3, 8].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let view = View { width: 90, height: 70, ..View::new(Side::From([1.0, 2.0, 3.0])) };
            (raymarch(&ball, &view).unwrap(), slice(&ball, &SliceView::new(Plane::Axial, 1.0)).unwrap())
        })
    });
    assert!(pictures.iter().all(|picture| *picture == pictures[0]));
}

#[test]
fn contours_follow_the_surface() {
    let ball = ball([1.0; 3], [60; 3], 20.0);
    // An octahedron of 15 mm. Its section at height 0 is a square with corners on the axes.
    let tip = |x: f32, y: f32, z: f32| Point3::new(x, y, z) * 0.015;
    let positions = [
        tip(1.0, 0.0, 0.0),
        tip(-1.0, 0.0, 0.0),
        tip(0.0, 1.0, 0.0),
        tip(0.0, -1.0, 0.0),
        tip(0.0, 0.0, 1.0),
        tip(0.0, 0.0, -1.0),
    ];
    let triangles = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    let contour = Contour {
        origin_mm: Point3::new(3.0, 0.0, 0.0),
        positions: &positions,
        triangles: &triangles,
        color: [255, 0, 0],
    };
    let view = SliceView { annotate: false, contours: &[contour], ..SliceView::new(Plane::Axial, 0.0) };
    let image = slice(&ball, &view).unwrap();
    let red = |[r, g, b]: [u8; 3]| r > 200 && g < 80 && b < 80;
    let [x, y] = centroid(&image, red);
    assert!(
        (x + 3.0).abs() < 0.3 && y.abs() < 0.3,
        "center of the square at {x}, {y}: patient right is on the left"
    );
    let count = (0..3600).filter(|p| red(image.pixel(p % 60, p / 60).unwrap())).count();
    assert!((40..140).contains(&count), "{count} red pixels for a square of 85 mm");
    let plain = slice(&ball, &SliceView { contours: &[], ..view }).unwrap();
    assert!((0..3600).all(|p| !red(plain.pixel(p % 60, p / 60).unwrap())), "control");

    let broken = Contour { triangles: &[[0, 1, 6]], ..contour };
    let error = slice(&ball, &SliceView { contours: &[broken], ..view }).unwrap_err();
    assert!(matches!(error, RenderError::VertexOutOfRange { contour: 0, triangle: 0, vertices: 6, .. }));
}

#[test]
fn png_files_decode_to_the_same_pixels() {
    let folder = tempfile::tempdir().unwrap();
    let mut image = Image::new(7, 5, [10, 20, 30]).unwrap();
    image.blend(6, 4, [250, 240, 230], 1.0);
    let path = folder.path().join("a.png");
    image.write_png(&path).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    assert_eq!(bytes, image.to_png().unwrap());
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    let mut pixels = vec![0; 7 * 5 * 3];
    let info = reader.next_frame(&mut pixels).unwrap();
    assert_eq!((info.width, info.height, info.color_type), (7, 5, png::ColorType::Rgb));
    assert_eq!(pixels, image.rgb);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    assert!(image.write_png(folder.path().join("missing/a.png")).is_err());
    let torn = Image { rgb: vec![0; 5], ..image };
    assert!(torn.to_png().is_err() && torn.write_png(folder.path().join("b.png")).is_err());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing half-written is left");
}

#[test]
fn invalid_sizes_and_settings_are_refused() {
    let ball = ball([1.0; 3], [20; 3], 6.0);
    let good = View { width: 20, height: 20, ..View::new(Side::Anterior) };
    for (width, height) in [(0, 5), (5, 0), (usize::MAX, usize::MAX), (1 << 40, 1 << 30), (1 << 20, 1 << 20)]
    {
        let error = raymarch(&ball, &View { width, height, ..good }).unwrap_err();
        assert!(matches!(error, RenderError::ImageSize { .. }), "{error}");
    }
    for long_side in [usize::MAX, 1 << 30] {
        let view = SliceView { long_side: Some(long_side), ..SliceView::new(Plane::Axial, 0.0) };
        assert!(matches!(slice(&ball, &view).unwrap_err(), RenderError::ImageSize { .. }));
    }
    let focus = |center: f64, size_mm: f64| Some(Focus { center_mm: [center, 0.0, 0.0], size_mm });
    let bad = [
        ("threshold_hu", View { threshold_hu: f32::NAN, ..good }),
        ("samples", View { samples: 0, ..good }),
        ("occlusion_mm", View { occlusion_mm: -1.0, ..good }),
        ("skin_mm", View { skin_mm: 0.0, ..good }),
        ("focus.size_mm", View { focus: focus(0.0, 0.0), ..good }),
        ("focus.center_mm", View { focus: focus(f64::INFINITY, 1.0), ..good }),
        ("side", View { side: Side::From([0.0; 3]), ..good }),
    ];
    for (key, view) in bad {
        let error = raymarch(&ball, &view).unwrap_err();
        assert!(matches!(error, RenderError::Setting { key: found, .. } if found == key), "{key}: {error}");
    }
    assert!(raymarch(&ball, &View { focus: focus(1e300, 1e300), ..good }).is_ok());
    assert!(raymarch(&ball, &View { focus: focus(0.0, 1e-300), ..good }).is_ok());
    let view = SliceView { window_hu: 0.0, ..SliceView::new(Plane::Axial, 0.0) };
    assert!(matches!(slice(&ball, &view).unwrap_err(), RenderError::Setting { key: "window_hu", .. }));
    assert!(side_by_side(&[]).is_err());
}

#[test]
fn pictures_of_one_voxel_work() {
    let grid = Grid { shape: [1; 3], affine: Affine::from_spacing([2.0; 3], [0.0; 3]).unwrap() };
    let dot = Volume::new(grid, vec![40], 1.0, 0.0).unwrap();
    assert_eq!(slice(&dot, &SliceView::new(Plane::Axial, 0.0)).unwrap().width, 1);
    assert!(raymarch(&dot, &View { width: 9, height: 9, ..View::new(Side::Left) }).is_ok());
}

#[test]
fn pictures_stand_side_by_side_under_captions() {
    let red = Image::new(100, 80, [200, 0, 0]).unwrap();
    let blue = Image::new(60, 90, [0, 0, 200]).unwrap();
    let whole = side_by_side(&[(&red, "before"), (&blue, "after")]).unwrap();
    assert_eq!((whole.width, whole.height), (164, 103));
    assert_eq!(whole.pixel(50, 13), Some([200, 0, 0]));
    assert_eq!(whole.pixel(104, 102), Some([0, 0, 200]));
    assert!((0..100).any(|x| whole.pixel(x, 6) == Some([255; 3])), "the caption is there");
}
