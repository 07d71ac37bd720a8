//! Depth of moved skin vertices below skins with a closed form.

use cutis_mesh::{Grading, Lattice, Planes, SkinMode, Split};
use cutis_skin::SkinMoves;
use cutis_test_kit::Random;
use nalgebra::{Matrix3, Point3, Rotation3, Vector3};

use crate::shapes::{Body, grid, lattice};

/// Points along each axis of the lattices.
const POINTS: usize = 27;

/// Number of planes from the border within which vertices do not count.
const MARGIN: usize = 7;

/// Depths of the skin vertices of bodies below the exact skin, in lattice steps.
#[derive(Default)]
struct Depths {
    /// Mean and standard deviation for each body.
    bodies: Vec<[f64; 2]>,
}

impl Depths {
    fn add(&mut self, depths: &[f64]) {
        assert!(depths.len() > 50, "{}", depths.len());
        let count = depths.len() as f64;
        let mean = depths.iter().sum::<f64>() / count;
        let variance = depths.iter().map(|depth| (depth - mean).powi(2)).sum::<f64>() / count;
        self.bodies.push([mean, variance.sqrt()]);
    }

    /// Mean over the bodies of the mean and of the standard deviation.
    fn mean(&self) -> [f64; 2] {
        [0, 1].map(|n| self.bodies.iter().map(|body| body[n]).sum::<f64>() / self.bodies.len() as f64)
    }

    /// Lowest and highest mean of a body.
    fn range(&self) -> [f64; 2] {
        let means = || self.bodies.iter().map(|body| body[0]);
        [means().fold(f64::INFINITY, f64::min), means().fold(f64::NEG_INFINITY, f64::max)]
    }
}

/// Depths of CTs and of masks, as they are and moved.
#[derive(Default)]
struct Measured([[Depths; 2]; 2]);

impl Measured {
    /// Adds a body. `step` is the lattice step in mm.
    fn add(&mut self, lattice: &Lattice, step: f64, distance: impl Fn(Point3<f64>) -> f64) {
        let ct = Body::from_ct(lattice.clone(), 3, &distance);
        for (body, depths) in [ct, Body::binary(lattice.clone(), &distance)].iter().zip(&mut self.0) {
            let SkinMoves { points, mm, .. } = SkinMoves::of(&body.skin());
            let moved = body.lattice.with_moves(points.clone(), mm).unwrap();
            let grid = body.lattice.grid();
            let inner = |point: &[usize; 3]| {
                (0..3).all(|axis| (MARGIN..grid.shape[axis] - MARGIN).contains(&point[axis]))
            };
            let at: Vec<_> = points.iter().map(|&point| grid.point(point as usize)).filter(inner).collect();
            for (lattice, depths) in [&body.lattice, &moved].into_iter().zip(depths) {
                depths.add(&at.iter().map(|&point| -distance(lattice.mm(point)) / step).collect::<Vec<_>>());
            }
        }
    }

    /// Prints a row of the table in the documentation, and checks it. `most` holds the largest
    /// standard deviation of moved CTs and masks, and `near` the range of the means of moved CTs.
    fn check(&self, name: &str, most: [f64; 2], near: [f64; 2]) {
        let shown = |depths: &Depths| {
            let [mean, deviation] = depths.mean();
            format!("{mean:.2}, {deviation:.2}")
        };
        let [ct, mask] = &self.0;
        eprintln!(
            "\n/// | {name} | {} | {} | {} | {} |",
            shown(&ct[0]),
            shown(&ct[1]),
            shown(&mask[0]),
            shown(&mask[1])
        );
        let [low, high] = ct[1].range();
        eprintln!("{low:.3} to {high:.3}");
        assert!(near[0] <= low && high <= near[1], "{name}: moved CTs are {low} to {high} steps deep");
        for (depths, most) in self.0.iter().zip(most) {
            let [staircase, moved] = depths.each_ref().map(|depths| depths.mean()[1]);
            assert!(moved <= most, "{name}: {moved}");
            // Control: the staircase.
            assert!(staircase > most, "{name}: {staircase}");
        }
    }
}

fn half_spaces(
    steps_mm: Matrix3<f64>,
    count: usize,
    normal: impl Fn(&mut Random) -> Vector3<f64>,
) -> Measured {
    let (lattice, mut random, mut measured) =
        (lattice(POINTS, steps_mm), Random::new(1), Measured::default());
    let step = steps_mm.determinant().abs().cbrt();
    for _ in 0..count {
        let normal = normal(&mut random).normalize();
        let offset = random.between(-step, step);
        measured.add(&lattice, step, |p| p.coords.dot(&normal) - offset);
    }
    measured
}

fn tilted(degrees: f64) -> Measured {
    let tilt = Rotation3::from_axis_angle(&Vector3::x_axis(), degrees.to_radians());
    half_spaces(Matrix3::identity() * 2.0, 8, |_| tilt * Vector3::z())
}

fn spheres(radius: f64) -> Measured {
    let (lattice, mut random, mut measured) =
        (lattice(POINTS, Matrix3::identity()), Random::new(2), Measured::default());
    for _ in 0..4 {
        let middle = random.vector() * 0.5;
        measured.add(&lattice, 1.0, |p| (p.coords - middle).norm() - radius);
    }
    measured
}

#[test]
fn depths_below_the_exact_skin() {
    half_spaces(Matrix3::identity() * 2.0, 30, Random::vector).check("half-spaces", [0.08, 0.10], [0.4, 0.6]);
    tilted(2.0).check("half-spaces, tilted by 2°", [0.03, 0.24], [0.4, 0.6]);
    tilted(5.0).check("half-spaces, tilted by 5°", [0.03, 0.2], [0.4, 0.6]);
    tilted(10.0).check("half-spaces, tilted by 10°", [0.03, 0.12], [0.4, 0.6]);
    spheres(4.0).check("spheres, radius 4 steps", [0.16, 0.18], [0.9, 1.1]);
    spheres(9.0).check("spheres, radius 9 steps", [0.12, 0.14], [0.6, 0.85]);
    let mirrored = Rotation3::from_euler_angles(0.5, -0.2, 0.8).matrix()
        * Matrix3::from_diagonal(&Vector3::new(-1.5, 1.5, 1.5));
    half_spaces(mirrored, 10, Random::vector).check(
        "half-spaces, rotated and mirrored axes",
        [0.08, 0.12],
        [0.4, 0.6],
    );
}

/// Skin over fat is as deep as skin over muscle. The control is lighter than fat, so that its skin
/// is taken for deeper.
#[test]
fn skin_over_fat_has_the_same_depth() {
    let (lattice, mut random) = (lattice(POINTS, Matrix3::identity()), Random::new(3));
    for _ in 0..8 {
        let normal = random.vector().normalize();
        let mut body = Body::from_ct(lattice.clone(), 3, |p| p.coords.dot(&normal));
        let shares: Vec<f32> = body.hu.iter().map(|hu| (hu + 1000.0) / 1040.0).collect();
        let [muscle, fat, light] = [1040.0, 900.0, 750.0].map(|hu_above_air| {
            body.hu = shares.iter().map(|share| hu_above_air * share - 1000.0).collect();
            let SkinMoves { points, mm, .. } = SkinMoves::of(&body.skin());
            let at = |&point: &u32| lattice.mm(lattice.grid().point(point as usize));
            points.iter().zip(&mm).map(|(point, mm)| -(at(point) + mm).coords.dot(&normal)).sum::<f64>()
                / points.len() as f64
        });
        assert!((fat - muscle).abs() < 0.05, "{fat} over fat, {muscle} over muscle");
        assert!((light - muscle).abs() > 0.05, "{light} over lighter tissue, {muscle} over muscle");
    }
}

/// A flat skin across an axis stays flat, and its depth no longer depends on where it is between
/// two planes.
#[test]
fn flat_skins_have_one_depth() {
    let lattice = lattice(POINTS, Matrix3::identity());
    for offset in [0.1, 0.3, 0.5, 0.7, 0.9] {
        let body = Body::from_ct(lattice.clone(), 3, |p| p.z - offset);
        let SkinMoves { points, mm, unmoved } = SkinMoves::of(&body.skin());
        assert_eq!(unmoved, 0);
        for (&point, mm) in points.iter().zip(&mm) {
            assert_eq!([mm.x, mm.y], [0.0; 2]);
            let at = lattice.mm(lattice.grid().point(point as usize));
            let depth = offset - (at.z + mm.z);
            assert!((depth - 0.5).abs() < 0.1, "{offset}: {depth}");
        }
    }
}

/// In the coarse part of a graded lattice the depth is half a step of that part, within a quarter
/// of a step: the blur over growing steps shifts it.
#[test]
fn the_step_of_a_graded_lattice_is_that_at_the_skin() {
    let even = grid(POINTS, Matrix3::identity());
    let grading = Grading { growth: 1.3, coarsest: 4.0 };
    let fine = [[0.0, 26.0], [0.0, 26.0], [0.0, 4.0]];
    let lattice = Lattice::graded(even, Split::Kuhn6, Planes::new(&even, fine, &grading).unwrap()).unwrap();
    let planes = lattice.planes().unwrap().axes()[2].clone();
    let n = planes.iter().position(|&plane| plane > 14.0).unwrap();
    let (below, step) = (planes[n] - 13.0, planes[n + 1] - planes[n]);
    assert!(step > 2.0, "{step}");
    for share in [0.2, 0.5, 0.8] {
        let skin = below + share * step;
        let body = Body::from_ct(lattice.clone(), 3, |p| p.z - skin);
        let SkinMoves { points, mm, .. } = SkinMoves::of(&body.skin());
        for (&point, mm) in points.iter().zip(&mm) {
            let at = lattice.grid().point(point as usize);
            let depth = (skin - lattice.mm(at).z - mm.z) / step;
            assert!(at[2] == n && (depth - 0.5).abs() < 0.25, "{share}: plane {} of {n}, {depth}", at[2]);
        }
    }
}

/// Sheets of two lattice points and the border of the lattice.
#[test]
fn thin_sheets_stay_and_vertices_on_the_border_stay_on_it() {
    let lattice = lattice(15, Matrix3::identity() * 3.0);
    let sheet = Body::binary(lattice.clone(), |p| (p.z - 1.5).abs() - 1.6);
    let moves = SkinMoves::of(&sheet.skin());
    assert_eq!((moves.unmoved, moves.points.len()), (moves.points.len(), moves.mm.len()));
    assert!(moves.mm.iter().all(|mm| *mm == Vector3::zeros()));

    let normal = Vector3::new(0.3, 0.2, 1.0).normalize();
    let body = Body::from_ct(lattice.clone(), 3, |p| p.coords.dot(&normal));
    let moves = SkinMoves::of(&body.skin());
    let (mut on_border, mut moved) = (0, 0);
    for (&point, mm) in moves.points.iter().zip(&moves.mm) {
        let at = lattice.grid().point(point as usize);
        for axis in (0..3).filter(|&axis| at[axis] == 0 || at[axis] == 14) {
            on_border += 1;
            moved += usize::from(mm.norm() > 0.1);
            assert!(mm[axis].abs() < 1e-9, "{at:?}: {mm:?}");
        }
    }
    assert!(on_border > 20 && moved > 20, "{on_border} and {moved}");
}

/// The scanner table below a body: partial volume of a body in air, and a board one step away.
#[test]
fn a_table_does_not_move_the_skin_to_it() {
    let lattice = lattice(POINTS, Matrix3::identity());
    let normal = Vector3::new(0.1, 0.25, 1.0).normalize();
    let alone = Body::from_ct(lattice.clone(), 3, |p| p.coords.dot(&normal));
    let mut hu = alone.hu.clone();
    let above = |point: usize| lattice.mm(lattice.grid().point(point)).coords.dot(&normal);
    (0..hu.len()).filter(|&point| (2.2..4.2).contains(&above(point))).for_each(|point| hu[point] = 100.0);
    let with_table = Body { hu, ..Body::new(lattice.clone(), alone.hu.clone(), SkinMode::Boundary) };
    let [alone, with_table] = [alone, with_table].map(|body| SkinMoves::of(&body.skin()));
    assert_eq!(alone.points, with_table.points);
    for (a, b) in alone.mm.iter().zip(&with_table.mm) {
        assert!((a - b).norm() < 0.2, "{a} {b}");
    }
}
