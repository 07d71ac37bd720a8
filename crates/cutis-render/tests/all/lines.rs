//! Lines of a field of directions on pictures of a ball.

use cutis_render::{Focus, Image, LineField, RenderError, Side, View, draw_lines, raymarch};
use cutis_volume::{Affine, Grid, Volume};
use nalgebra::{Point3, Vector3};

const RADIUS_MM: f64 = 20.0;
const COLOR: [u8; 3] = [0, 0, 200];

/// A ball at the origin, and a plate in front of its right half if `plate` is true.
fn ball(plate: bool) -> Volume {
    let grid = Grid { shape: [61, 61, 61], affine: Affine::from_spacing([1.0; 3], [-30.0; 3]).unwrap() };
    let hu = |p: Point3<f64>| {
        let in_plate = plate && p.x > 2.0 && p.y > 25.0 && p.y < 28.0;
        let depth = if in_plate { 1.0 } else { RADIUS_MM - p.coords.norm() };
        (-300.0 + 400.0 * depth).clamp(-1000.0, 40.0) as i16
    };
    let voxels = (0..grid.len()).map(|v| hu(grid.mm(grid.point(v)))).collect();
    Volume::new(grid, voxels, 1.0, 0.0).unwrap()
}

/// A sphere of triangles with a direction at each.
struct Sphere {
    positions: Vec<Point3<f32>>,
    triangles: Vec<[u32; 3]>,
    directions: Vec<[f32; 3]>,
    weights: Vec<f32>,
}

impl Sphere {
    /// A sphere with this radius and the directions `axis × n`, with a weight by place.
    fn new(radius_mm: f64, axis: [f64; 3], weight: impl Fn(Vector3<f64>) -> f32) -> Self {
        let (rings, parts) = (40, 80);
        let place = |ring: usize, part: usize| {
            let (polar, turn) = (
                ring as f64 / rings as f64 * std::f64::consts::PI,
                part as f64 / parts as f64 * std::f64::consts::TAU,
            );
            Vector3::new(polar.sin() * turn.cos(), polar.sin() * turn.sin(), polar.cos())
        };
        let number = |ring: usize, part: usize| (ring * parts + part % parts) as u32;
        let mut sphere = Self { positions: vec![], triangles: vec![], directions: vec![], weights: vec![] };
        for ring in 0..=rings {
            sphere.positions.extend(
                (0..parts).map(|part| Point3::from((place(ring, part) * radius_mm / 1000.0).cast::<f32>())),
            );
        }
        for ring in 0..rings {
            for part in 0..parts {
                let corners = [(ring, part), (ring + 1, part), (ring + 1, part + 1), (ring, part + 1)];
                let [a, b, c, d] = corners.map(|(ring, part)| number(ring, part));
                let normal =
                    corners.map(|(ring, part)| place(ring, part)).iter().sum::<Vector3<f64>>().normalize();
                let direction = Vector3::from(axis).cross(&normal).normalize();
                for triangle in [[a, b, c], [a, c, d]] {
                    sphere.triangles.push(triangle);
                    sphere.directions.push(direction.cast::<f32>().into());
                    sphere.weights.push(weight(normal));
                }
            }
        }
        sphere
    }

    fn field(&self) -> LineField<'_> {
        LineField {
            origin_mm: Point3::origin(),
            positions: &self.positions,
            triangles: &self.triangles,
            directions: &self.directions,
            weights: &self.weights,
            color: COLOR,
            label: "",
        }
    }
}

/// From the front, without letters: 10 pixels are 1.5 mm.
fn view() -> View<'static> {
    let focus = Some(Focus { center_mm: [0.0; 3], size_mm: 60.0 });
    View { width: 400, height: 400, focus, annotate: false, ..View::new(Side::Anterior) }
}

fn plain(volume: &Volume) -> Image {
    raymarch(volume, &view()).unwrap()
}

fn drawn(volume: &Volume, field: &LineField<'_>) -> Image {
    let mut image = plain(volume);
    draw_lines(&mut image, volume, &view(), field).unwrap();
    image
}

/// Pixels that lines have changed, as millimeters to the right and upwards of the center, and the
/// change of red.
fn changed(volume: &Volume, field: &LineField<'_>) -> Vec<([f64; 2], i32)> {
    let (before, after) = (plain(volume), drawn(volume, field));
    let all = (0..400).flat_map(|y| (0..400).map(move |x| [x, y]));
    let differs = |[x, y]: [usize; 2]| {
        let (old, new) = (before.pixel(x, y)?, after.pixel(x, y)?);
        let mm = [x as f64 - 199.5, 199.5 - y as f64].map(|pixels| pixels * 60.0 / 400.0);
        (old != new).then(|| (mm, i32::from(old[0]) - i32::from(new[0])))
    };
    all.filter_map(differs).collect()
}

/// Number of pixels whose neighbor along the axis is changed too, over those across it.
fn elongation(pixels: &[([f64; 2], i32)], axis: usize) -> f64 {
    let near: Vec<[i64; 2]> =
        pixels.iter().map(|(mm, _)| mm.map(|c| (c / 60.0 * 400.0 + 199.5).round() as i64)).collect();
    let set: std::collections::HashSet<[i64; 2]> = near.iter().copied().collect();
    let beyond = |axis: usize| {
        let further = |at: &&[i64; 2]| {
            let mut next = **at;
            next[axis] += 4;
            set.contains(&next)
        };
        near.iter().filter(further).count()
    };
    beyond(axis) as f64 / beyond(1 - axis).max(1) as f64
}

#[test]
fn lines_follow_the_field_and_stay_on_the_ball() {
    let ball = ball(false);
    for (axis, along) in [([0.0, 0.0, 1.0], 0), ([1.0, 0.0, 0.0], 1)] {
        let sphere = Sphere::new(RADIUS_MM - 0.5, axis, |_| 1.0);
        let pixels = changed(&ball, &sphere.field());
        assert!(pixels.len() > 5000, "{} pixels", pixels.len());
        assert!(elongation(&pixels, along) > 4.0, "{axis:?}: {}", elongation(&pixels, along));
        assert!(pixels.iter().all(|(mm, _)| mm[0].hypot(mm[1]) < RADIUS_MM + 0.3));
    }
}

/// The plate hides the right half of the ball, which is on the left of the picture.
#[test]
fn hidden_lines_are_not_drawn() {
    let sphere = Sphere::new(RADIUS_MM - 0.5, [0.0, 0.0, 1.0], |_| 1.0);
    let [open, hidden] = [false, true].map(|plate| changed(&ball(plate), &sphere.field()));
    let left = |pixels: &[([f64; 2], i32)]| pixels.iter().filter(|(mm, _)| mm[0] < -3.5).count();
    let right = |pixels: &[([f64; 2], i32)]| pixels.iter().filter(|(mm, _)| mm[0] > -1.0).count();
    assert!(left(&open) > 2000 && left(&hidden) == 0, "{} and {}", left(&open), left(&hidden));
    assert!(right(&hidden) as f64 > 0.8 * right(&open) as f64, "{} and {}", right(&open), right(&hidden));
    // A field far inside the ball, and one on its far side only, are hidden too.
    let inside = Sphere::new(0.6 * RADIUS_MM, [0.0, 0.0, 1.0], |_| 1.0);
    assert!(changed(&ball(false), &inside.field()).is_empty());
    let behind =
        Sphere::new(RADIUS_MM - 0.5, [0.0, 0.0, 1.0], |normal| if normal.y < -0.3 { 1.0 } else { 0.0 });
    assert!(changed(&ball(false), &behind.field()).is_empty());
}

#[test]
fn lines_fade_with_the_weight() {
    let ball = ball(false);
    let darkest = |weight: f32| {
        let sphere = Sphere::new(RADIUS_MM - 0.5, [0.0, 0.0, 1.0], |_| weight);
        let near = changed(&ball, &sphere.field()).into_iter().filter(|(mm, _)| mm[0].hypot(mm[1]) < 8.0);
        near.map(|(_, change)| change).max().unwrap_or(0)
    };
    let [full, half, none] = [1.0, 0.5, 0.0].map(darkest);
    assert!(full > 50 && none == 0, "{full} and {none}");
    assert!((f64::from(half) / f64::from(full) - 0.5).abs() < 0.05, "{half} of {full}");
}

#[test]
fn letters_scale_and_legend_are_drawn_over_the_lines() {
    let ball = ball(false);
    let sphere = Sphere::new(RADIUS_MM - 0.5, [0.0, 0.0, 1.0], |_| 0.0);
    let with = View { annotate: true, ..view() };
    let mut image = plain(&ball);
    draw_lines(&mut image, &ball, &with, &sphere.field()).unwrap();
    assert_eq!(image, raymarch(&ball, &with).unwrap(), "without lines and legend");
    let mut named = plain(&ball);
    draw_lines(&mut named, &ball, &with, &LineField { label: "lines", ..sphere.field() }).unwrap();
    let all = (0..400).flat_map(|y| (0..400).map(move |x| (x, y)));
    let differ: Vec<_> = all.filter(|&(x, y)| image.pixel(x, y) != named.pixel(x, y)).collect();
    assert!(differ.len() > 100 && differ.iter().all(|&(x, y)| x > 300 && y > 380), "{}", differ.len());
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let ball = ball(true);
    let sphere = Sphere::new(RADIUS_MM - 0.5, [0.3, 0.2, 1.0], |normal| normal.z.abs() as f32);
    let pictures = [1, 2, 3, 8].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| drawn(&ball, &sphere.field()))
    });
    assert!(pictures.iter().all(|picture| *picture == pictures[0]));
    let other = Sphere::new(RADIUS_MM - 0.5, [0.0, 0.2, 1.0], |normal| normal.z.abs() as f32);
    assert!(drawn(&ball, &other.field()) != pictures[0], "control");
}

#[test]
fn inconsistent_fields_and_pictures_are_refused() {
    let ball = ball(false);
    let sphere = Sphere::new(RADIUS_MM, [0.0, 0.0, 1.0], |_| 1.0);
    let good = sphere.field();
    let refused = |view: &View<'_>, field: &LineField<'_>| {
        draw_lines(&mut plain(&ball), &ball, view, field).unwrap_err()
    };
    let short = refused(&view(), &LineField { weights: &[1.0], ..good });
    let triangles = sphere.triangles.len();
    assert!(
        matches!(short, RenderError::FieldLength { array: "weights", expected, found: 1 } if expected == triangles)
    );
    let short = refused(&view(), &LineField { directions: &[], ..good });
    assert!(matches!(short, RenderError::FieldLength { array: "directions", found: 0, .. }));
    let outside = refused(&view(), &LineField { positions: &sphere.positions[1..], ..good });
    assert!(matches!(outside, RenderError::VertexOutOfRange { .. }));
    let size = refused(&View { width: 399, ..view() }, &good);
    assert!(matches!(size, RenderError::Setting { key: "view.width", .. }));
}
