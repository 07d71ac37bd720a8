//! Accuracy of the normals of skins with a closed form.

use cutis_mesh::{Grading, Lattice, Planes, Split};
use cutis_skin::Normals;
use cutis_test_kit::Random;
use nalgebra::{Matrix3, Point3, Rotation3, Vector3};

use crate::shapes::{Body, grid, lattice};

/// Points along each axis of the lattices.
const POINTS: usize = 27;

/// Number of planes from the border within which triangles count apart.
const MARGIN: usize = 7;

/// Number of random half-spaces.
const PLANES: usize = 50;

/// Number of random spheres and cylinders.
const ROUND: usize = 4;

/// Angles in degrees.
#[derive(Default)]
struct Angles(Vec<f64>);

impl Angles {
    fn mean(&self) -> f64 {
        self.0.iter().sum::<f64>() / self.0.len() as f64
    }

    fn worst(&self) -> f64 {
        self.0.iter().copied().fold(0.0, f64::max)
    }
}

/// Angle between two vectors in degrees.
fn angle(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b)).to_degrees()
}

/// Errors of the normals and of the facets.
#[derive(Default)]
struct Errors {
    /// Away from the border of the lattice.
    inner: Angles,
    /// In the last planes along the third axis, away from the other borders.
    end: Angles,
    facets: Angles,
    from_facets: usize,
}

impl Errors {
    fn add(&mut self, body: &Body, exact: impl Fn(Point3<f64>) -> Vector3<f64>) {
        let normals = Normals::of(&body.skin());
        assert_eq!(normals.vectors.len(), body.triangles.len());
        self.from_facets += normals.from_facets;
        for (triangle, normal) in body.triangles.iter().zip(&normals.vectors) {
            assert!((normal.norm() - 1.0).abs() < 1e-12);
            let exact = exact(body.center(triangle));
            let [lateral, end] = body.border_distance(triangle);
            if lateral >= MARGIN && end >= MARGIN {
                self.inner.0.push(angle(normal, &exact));
                self.facets.0.push(angle(&body.facet_normal(triangle), &exact));
            } else if lateral >= MARGIN && end < 2 {
                self.end.0.push(angle(normal, &exact));
            }
        }
    }
}

/// Errors of masks and of CTs.
#[derive(Default)]
struct Pair([Errors; 2]);

impl Pair {
    fn add(
        &mut self,
        lattice: &Lattice,
        distance: impl Fn(Point3<f64>) -> f64,
        exact: impl Fn(Point3<f64>) -> Vector3<f64>,
    ) {
        self.0[0].add(&Body::binary(lattice.clone(), &distance), &exact);
        self.0[1].add(&Body::from_ct(lattice.clone(), 3, &distance), &exact);
    }

    /// Prints a row of the table in the documentation, and checks it. `most` holds the largest mean
    /// and the largest worst error of masks and of CTs.
    fn check(&self, name: &str, most: [[f64; 2]; 2]) {
        let [mask, ct] = &self.0;
        eprintln!(
            "\n/// | {name} | {:.2}, {:.1} | {:.2}, {:.1} | {:.0}, {:.0} |",
            mask.inner.mean(),
            mask.inner.worst(),
            ct.inner.mean(),
            ct.inner.worst(),
            mask.facets.mean(),
            mask.facets.worst()
        );
        for (errors, [mean, worst]) in self.0.iter().zip(most) {
            assert!(errors.inner.0.len() > 500, "{name}: {}", errors.inner.0.len());
            assert!(errors.inner.mean() <= mean, "{name}: {}", errors.inner.mean());
            assert!(errors.inner.worst() <= worst, "{name}: {}", errors.inner.worst());
            assert_eq!(errors.from_facets, 0, "{name}");
            // Control: the facets of the lattice.
            assert!(errors.facets.mean() > 20.0 && errors.facets.worst() > 60.0, "{name}");
        }
    }
}

fn half_spaces(steps_mm: Matrix3<f64>) -> Pair {
    let (lattice, mut random, mut pair) = (lattice(POINTS, steps_mm), Random::new(1), Pair::default());
    let step = steps_mm.determinant().abs().cbrt();
    for _ in 0..PLANES {
        let normal = random.vector().normalize();
        let offset = random.between(-step, step);
        pair.add(&lattice, |p| p.coords.dot(&normal) - offset, |_| normal);
    }
    pair
}

fn spheres(steps_mm: Matrix3<f64>, radius_steps: f64) -> Pair {
    let (lattice, mut random, mut pair) = (lattice(POINTS, steps_mm), Random::new(2), Pair::default());
    let step = steps_mm.determinant().abs().cbrt();
    for _ in 0..ROUND {
        let center = random.point() * step;
        let exact = |p: Point3<f64>| (p - center).normalize();
        pair.add(&lattice, |p| (p - center).norm() - radius_steps * step, exact);
    }
    pair
}

fn cylinders(steps_mm: Matrix3<f64>, radius_steps: f64) -> Pair {
    let (lattice, mut random, mut pair) = (lattice(POINTS, steps_mm), Random::new(3), Pair::default());
    let step = steps_mm.determinant().abs().cbrt();
    for _ in 0..ROUND {
        let (center, axis) = (random.point() * step, random.vector().normalize());
        let radial = |p: Point3<f64>| (p - center) - axis * axis.dot(&(p - center));
        pair.add(&lattice, |p| radial(p).norm() - radius_steps * step, |p| radial(p).normalize());
    }
    pair
}

#[test]
fn accuracy_on_an_even_lattice() {
    let even = Matrix3::identity() * 2.0;
    let planes = half_spaces(even);
    planes.check("half-spaces", [[0.8, 7.0], [0.45, 1.2]]);
    // Where the scan ends, in the last two planes.
    let [mask, ct] = planes.0.each_ref().map(|errors| errors.end.mean());
    eprintln!("\nend of the scan: {mask:.1}, {ct:.1}");
    assert!(planes.0.iter().all(|errors| errors.end.0.len() > 500) && mask < 3.0 && ct < 1.5);
    spheres(even, 6.0).check("spheres, radius 6 steps", [[1.0, 3.5], [0.4, 1.2]]);
    cylinders(even, 6.0).check("cylinders, radius 6 steps", [[1.0, 2.5], [0.4, 0.8]]);
}

#[test]
fn accuracy_with_steps_of_one_to_three() {
    let uneven = Matrix3::from_diagonal(&Vector3::new(0.8, 0.8, 2.4));
    half_spaces(uneven).check("half-spaces, steps 1 : 1 : 3", [[1.2, 4.5], [1.1, 3.5]]);
    let round = cylinders(uneven, 10.0);
    round.check("cylinders, radius 10 steps, steps 1 : 1 : 3", [[2.5, 10.0], [2.2, 5.5]]);
}

#[test]
fn accuracy_with_rotated_and_mirrored_axes() {
    let mirror = Matrix3::from_diagonal(&Vector3::new(-2.0, 2.0, 2.0));
    let rotated = Rotation3::from_euler_angles(0.4, -0.7, 1.1).matrix() * mirror;
    half_spaces(rotated).check("half-spaces, rotated and mirrored axes", [[0.8, 5.5], [0.5, 2.6]]);
}

#[test]
fn accuracy_with_sheared_axes() {
    let sheared = Matrix3::new(2.0, 0.0, 0.6, 0.0, 2.0, 0.5, 0.0, 0.0, 2.0);
    half_spaces(sheared).check("half-spaces, axes sheared by 21°", [[0.9, 5.5], [0.5, 1.3]]);
    let round = spheres(sheared, 6.0);
    round.check("spheres, radius 6 steps, axes sheared by 21°", [[2.1, 5.5], [2.2, 5.5]]);
}

#[test]
fn accuracy_on_a_graded_lattice() {
    let even = grid(49, Matrix3::identity());
    let planes = Planes::new(&even, [[20.0, 28.0]; 3], &Grading { growth: 1.3, coarsest: 4.0 }).unwrap();
    let lattice = Lattice::graded(even, Split::Kuhn6, planes).unwrap();
    let (mut random, mut pair) = (Random::new(4), Pair::default());
    for _ in 0..PLANES {
        let normal = random.vector().normalize();
        let offset = random.between(-8.0, 8.0);
        pair.add(&lattice, |p| p.coords.dot(&normal) - offset, |_| normal);
    }
    pair.check("half-spaces, graded lattice with a growth of 1.3", [[3.0, 9.0], [3.0, 9.0]]);
}

#[test]
fn other_objects_do_not_change_the_normals() {
    let lattice = lattice(15, Matrix3::identity());
    let body = Body::binary(lattice, |p| (p.x - 1.0).max(-6.5 - p.x));
    let mut board = Body { hu: body.hu.clone(), ..body };
    let before = Normals::of(&board.skin()).vectors;
    let grid = *board.lattice.grid();
    let outside: Vec<usize> = (0..grid.len()).filter(|&p| !board.vertices[p]).collect();
    outside.iter().for_each(|&point| board.hu[point] = if point % 2 == 0 { 700.0 } else { f32::NAN });
    assert_eq!(Normals::of(&board.skin()).vectors, before);
    // Control: a change within the body.
    let inside = (0..grid.len()).filter(|&p| board.vertices[p]).collect::<Vec<_>>();
    inside.iter().step_by(7).for_each(|&point| board.hu[point] = -300.0);
    assert_ne!(Normals::of(&board.skin()).vectors, before);
}

/// A sheet of tissue whose lowest and highest planes are `k` apart, with both of its faces.
fn sheet(thickness: usize) -> Body {
    let lattice = lattice(17, Matrix3::identity());
    let grid = *lattice.grid();
    let planes = 8..=8 + thickness;
    let vertices: Vec<bool> = (0..grid.len()).map(|point| planes.contains(&grid.point(point)[2])).collect();
    let hu = vertices.iter().map(|&vertex| if vertex { 40.0 } else { -1000.0 }).collect();
    let mut triangles = Vec::new();
    for (i, j) in (0..16).flat_map(|i| (0..16).map(move |j| (i, j))) {
        let at = |di: usize, dj: usize, k: usize| grid.index([i + di, j + dj, k]) as u32;
        for k in [8, 8 + thickness] {
            let faces = [[at(0, 0, k), at(1, 0, k), at(1, 1, k)], [at(0, 0, k), at(1, 1, k), at(0, 1, k)]];
            let upper = k > 8;
            triangles.extend(faces.map(|[a, b, c]| if upper { [a, b, c] } else { [a, c, b] }));
        }
    }
    Body { lattice, hu, vertices, triangles }
}

#[test]
fn thin_sheets_have_normals_to_both_sides() {
    for thickness in [1, 2, 5] {
        let body = sheet(thickness);
        let normals = Normals::of(&body.skin());
        assert_eq!(normals.from_facets, 0);
        for (triangle, normal) in body.triangles.iter().zip(&normals.vectors) {
            assert!(angle(normal, &body.facet_normal(triangle)) < 1e-3, "{thickness}: {normal}");
        }
    }
}

#[test]
fn a_sheet_without_thickness_takes_the_normals_of_its_facets() {
    let mut body = sheet(0);
    // Each face of a cell occurs twice, downwards.
    body.triangles = body.triangles.chunks(2).step_by(2).flatten().copied().collect();
    let normals = Normals::of(&body.skin());
    assert_eq!(normals.from_facets, body.triangles.len());
    for (triangle, normal) in body.triangles.iter().zip(&normals.vectors) {
        assert!(angle(normal, &body.facet_normal(triangle)) < 1e-6);
    }
}
