//! Paths on the skin of a ball, and the legends of lines.

use cutis_render::{
    Focus, Image, LineField, RenderError, Side, SkinPaths, View, draw_lines, draw_paths, raymarch,
};
use cutis_volume::{Affine, Grid, Volume};
use nalgebra::Point3;

const RADIUS_MM: f64 = 20.0;
const COLOR: [u8; 3] = [0, 0, 200];
/// Ground of the legend.
const GROUND: [u8; 3] = [40, 44, 52];

fn ball() -> Volume {
    let grid = Grid { shape: [61, 61, 61], affine: Affine::from_spacing([1.0; 3], [-30.0; 3]).unwrap() };
    let hu = |p: Point3<f64>| (-300.0 + 400.0 * (RADIUS_MM - p.coords.norm())).clamp(-1000.0, 40.0) as i16;
    let voxels = (0..grid.len()).map(|v| hu(grid.mm(grid.point(v)))).collect();
    Volume::new(grid, voxels, 1.0, 0.0).unwrap()
}

/// From the front: 10 pixels are 1.5 mm.
fn view(size_mm: f64, annotate: bool) -> View<'static> {
    let focus = Some(Focus { center_mm: [0.0; 3], size_mm });
    View { width: 400, height: 400, focus, annotate, ..View::new(Side::Anterior) }
}

/// A path along the ball, 2 mm below its skin, from 40° to the right to 40° to the left.
fn path(front: f64) -> Vec<Point3<f64>> {
    let at = |degrees: i32| {
        let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
        Point3::new(-18.0 * sin, front * 18.0 * cos, 0.0)
    };
    (-8..=8).map(|n| at(5 * n)).collect()
}

fn drawn(volume: &Volume, paths_mm: &[Vec<Point3<f64>>]) -> Image {
    let view = view(60.0, false);
    let mut image = raymarch(volume, &view).unwrap();
    draw_paths(&mut image, volume, &view, &SkinPaths { paths_mm, color: COLOR, label: "path" }).unwrap();
    image
}

/// Pixels in which two pictures differ.
fn differing(a: &Image, b: &Image) -> Vec<[usize; 2]> {
    let all = (0..a.height).flat_map(|y| (0..a.width).map(move |x| [x, y]));
    all.filter(|&[x, y]| a.pixel(x, y) != b.pixel(x, y)).collect()
}

/// The path crosses the picture at the height of the center, and a path on the far side is hidden.
#[test]
fn a_path_is_drawn_where_it_can_be_seen() {
    let volume = ball();
    let plain = raymarch(&volume, &view(60.0, false)).unwrap();
    let front = differing(&plain, &drawn(&volume, &[path(1.0)]));
    let half_mm = 18.0 * 40.0_f64.to_radians().sin();
    let half = (half_mm / 60.0 * 400.0).round() as usize;
    let ends = (front.iter().map(|at| at[0]).min().unwrap(), front.iter().map(|at| at[0]).max().unwrap());
    assert!(ends.0.abs_diff(200 - half) < 3 && ends.1.abs_diff(200 + half) < 3, "{ends:?}, ±{half}");
    assert!(front.iter().all(|[_, y]| (198..=201).contains(y)), "a straight line in the middle");
    assert!((ends.0..=ends.1).all(|x| front.iter().any(|at| at[0] == x)), "the line has no gap");
    assert_eq!(differing(&plain, &drawn(&volume, &[path(-1.0)])), Vec::<[usize; 2]>::new());
    assert_eq!(drawn(&volume, &[]), plain);
}

#[test]
fn a_picture_of_another_size_is_refused() {
    let (volume, paths_mm) = (ball(), [path(1.0)]);
    let mut image = Image::new(399, 400, [0; 3]).unwrap();
    let paths = SkinPaths { paths_mm: &paths_mm, color: COLOR, label: "" };
    let error = draw_paths(&mut image, &volume, &view(60.0, false), &paths).unwrap_err();
    assert!(matches!(error, RenderError::Setting { key: "view.width", .. }), "{error}");
}

/// Lines cover the picture, and none of them runs through the legend.
#[test]
fn no_line_runs_through_a_legend() {
    let volume = ball();
    let triangles = [[0_u32, 1, 2], [0, 2, 3]];
    let positions = [[20.0, 19.5, -20.0], [-20.0, 19.5, -20.0], [-20.0, 19.5, 20.0], [20.0, 19.5, 20.0]]
        .map(|mm| Point3::from(mm).map(|mm: f64| (mm / 1000.0) as f32));
    let field = |label| LineField {
        origin_mm: Point3::origin(),
        positions: &positions,
        triangles: &triangles,
        directions: &[[1.0, 0.0, 0.0]; 2],
        weights: &[1.0; 2],
        color: COLOR,
        label,
    };
    let view = view(12.0, true);
    let picture = |label| {
        let mut image = raymarch(&volume, &View { annotate: false, ..view }).unwrap();
        draw_lines(&mut image, &volume, &view, &field(label)).unwrap();
        image
    };
    let (with, without) = (picture("lines"), picture(""));
    let panel = differing(&with, &without);
    let (left, top) =
        (panel.iter().map(|at| at[0]).min().unwrap(), panel.iter().map(|at| at[1]).min().unwrap());
    assert!(left > 200 && top > 340, "the legend is at the bottom right: {left}, {top}");
    // Skin is red, and lines are blue. A line may share its rows with skin.
    let is_line =
        |image: &Image, x, y| image.pixel(x, y).is_some_and(|[r, _, b]| i32::from(b) > i32::from(r) - 30);
    let rows = |image: &Image, x| (top..400).filter(|&y| is_line(image, x, y)).count();
    let skin = (top..400).filter(|&y| !is_line(&with, left - 2, y)).count();
    // Left of the legend, and in its ground left of the sample.
    assert!(rows(&with, left - 2) > 0 && skin > 0, "lines run up to the legend");
    assert!(rows(&without, left) > 0, "lines are where the legend is");
    assert!((top..400).all(|y| with.pixel(left, y) == Some(GROUND)));
    assert!((left..400).all(|x| with.pixel(x, top) == Some(GROUND)));
}
