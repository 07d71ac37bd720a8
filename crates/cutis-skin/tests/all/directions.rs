//! Directions around and along axes and from strokes, on bodies with closed forms.

use cutis_mesh::{Lattice, SkinMode};
use cutis_skin::{Directions, Normals, SkinError, SkinField, Strokes, TangentField};
use cutis_test_kit::Random;
use nalgebra::{Matrix3, Point3, Vector3};

use crate::shapes::{Body, lattice};

fn cube(n: usize) -> Lattice {
    lattice(n, Matrix3::identity() * 2.0)
}

/// Angle in degrees between two directions without a sign.
fn angle(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b).abs()).to_degrees()
}

/// Mean angle over the triangles that `counts`.
fn mean_angle(
    body: &Body,
    field: &SkinField,
    exact: impl Fn(Point3<f64>) -> Vector3<f64>,
    counts: impl Fn(Point3<f64>) -> bool,
) -> f64 {
    let centers = body.triangles.iter().map(|triangle| body.center(triangle));
    let pairs = centers.zip(&field.directions).filter(|(center, _)| counts(*center));
    let angles: Vec<f64> = pairs.map(|(center, direction)| angle(direction, &exact(center))).collect();
    assert!(angles.len() > 50, "{}", angles.len());
    angles.iter().sum::<f64>() / angles.len() as f64
}

fn assert_tangent(field: &SkinField) {
    for ((normal, direction), weight) in field.normals.iter().zip(&field.directions).zip(&field.weights) {
        assert!((direction.norm() - 1.0).abs() < 1e-12 && normal.dot(direction).abs() < 1e-12);
        assert!((0.0..=1.0).contains(weight), "{weight}");
    }
}

#[test]
fn axes_on_a_cylinder() {
    let mut random = Random::new(8);
    for _ in 0..3 {
        let axis = random.vector().normalize();
        let radial = |p: Point3<f64>| p.coords - axis * axis.dot(&p.coords);
        let body = Body::binary(cube(31), |p| radial(p).norm() - 14.0);
        let around = |p: Point3<f64>| axis.cross(&radial(p)).normalize();
        let inner = |p: Point3<f64>| p.coords.amax() < 18.0;
        let scaled: [f64; 3] = (axis * 1e200).into();
        let fields = [Directions::Around(scaled), Directions::Along((axis * -3e-200).into())]
            .map(|directions| SkinField::new(&body.skin(), &directions).unwrap());
        fields.iter().for_each(assert_tangent);
        let errors =
            [mean_angle(&body, &fields[0], around, inner), mean_angle(&body, &fields[1], |_| axis, inner)];
        assert!(errors.iter().all(|&error| error < 1.5), "{errors:?}");
        assert!(fields.iter().all(|field| field.coverage > 0.99));
        // Control: the other direction.
        assert!(mean_angle(&body, &fields[1], around, inner) > 88.0);
    }
}

#[test]
fn the_weight_fades_where_the_skin_is_perpendicular_to_the_axis() {
    let body = Body::binary(cube(27), |p| p.coords.norm() - 20.0);
    let field = SkinField::new(&body.skin(), &Directions::Around([0.0, 0.0, -7.0])).unwrap();
    assert_tangent(&field);
    for (normal, &weight) in field.normals.iter().zip(&field.weights) {
        let sine = normal.xy().norm();
        assert!((sine > 0.2 || weight == 0.0) && (sine < 0.5 || weight == 1.0), "{sine} {weight}");
        assert_eq!(weight > 0.5, sine > 0.35);
    }
    // The zone of a sphere in which the sine is above 0.35 has the share √(1 − 0.35²).
    let exact = (1.0f64 - 0.35 * 0.35).sqrt();
    assert!((field.coverage - exact).abs() < 0.01, "{} {exact}", field.coverage);
    // Control: without the fade everything would be covered.
    assert!(exact < 0.95);
}

#[test]
fn axes_without_a_direction_are_refused() {
    let body = Body::binary(cube(9), |p| p.z);
    for axis in [[0.0; 3], [0.0, f64::NAN, 1.0], [f64::INFINITY, 0.0, 0.0]] {
        let refused = SkinField::new(&body.skin(), &Directions::Around(axis)).unwrap_err();
        assert!(matches!(refused, SkinError::Axis { key: "around", .. }), "{refused}");
        assert!(refused.to_string().contains(&format!("{axis:?}")), "{refused}");
        assert!(SkinField::new(&body.skin(), &Directions::Along(axis)).is_err());
    }
    let normals = Normals { vectors: Vec::new(), from_facets: 0 };
    let refused = TangentField::new(&body.skin(), &normals, &Directions::Along([1.0, 0.0, 0.0]));
    assert!(matches!(refused, Err(SkinError::Normals { found: 0, .. })));
}

/// A half-space with two unit vectors in its plane.
fn half_space(normal: Vector3<f64>) -> (Body, [Vector3<f64>; 2]) {
    let body = Body::binary(cube(25), |p| p.coords.dot(&normal));
    let first = normal.cross(&Vector3::ith(normal.iamin(), 1.0)).normalize();
    (body, [first, normal.cross(&first)])
}

fn strokes(lines: &[[Vector3<f64>; 2]]) -> Strokes {
    let lines: Vec<Vec<[f64; 3]>> = lines.iter().map(|line| line.map(Into::into).to_vec()).collect();
    Strokes::from_points("test", &lines).unwrap()
}

#[test]
fn one_stroke_covers_a_plane() {
    let mut random = Random::new(9);
    for _ in 0..5 {
        let (body, [u, v]) = half_space(random.vector().normalize());
        let way = u * 0.6 + v * 0.8;
        let field =
            |from, to| SkinField::new(&body.skin(), &Directions::Strokes(strokes(&[[from, to]]))).unwrap();
        let [forward, backward] = [field(way * -9.0, way * 9.0), field(way * 9.0, way * -9.0)];
        assert_tangent(&forward);
        assert!(mean_angle(&body, &forward, |_| way, |_| true) < 2.0);
        assert!(forward.coverage > 0.99, "{}", forward.coverage);
        // The sign has no meaning.
        for (a, b) in forward.directions.iter().zip(&backward.directions) {
            assert!(angle(a, b) < 5.0);
        }
        // Control: a stroke that is turned by 90°.
        let across = way.cross(&u.cross(&v));
        let turned = field(across * -9.0, across * 9.0);
        assert!(mean_angle(&body, &turned, |_| way, |_| true) > 85.0);
    }
}

#[test]
fn the_field_turns_from_one_stroke_to_the_next() {
    let (body, [u, v]) = half_space(Vector3::z());
    let turned = |degrees: f64| u * degrees.to_radians().cos() + v * degrees.to_radians().sin();
    let line = |middle: Vector3<f64>, way: Vector3<f64>| [middle - way * 24.0, middle + way * 24.0];
    // Two strokes along v at both ends of u, at angles of 70° and 110° to u.
    for (degrees, weight) in [(20.0f64, 0.7), (45.0, 0.0)] {
        let given = strokes(&[
            line(u * -20.0, turned(90.0 - degrees) * 0.3),
            line(u * 20.0, turned(90.0 + degrees) * 0.3),
        ]);
        let field = SkinField::new(&body.skin(), &Directions::Strokes(given)).unwrap();
        assert_tangent(&field);
        let middle = |p: Point3<f64>| p.coords.dot(&u).abs() < 3.0 && p.coords.norm() < 16.0;
        let weights: Vec<f64> = body
            .triangles
            .iter()
            .zip(&field.weights)
            .filter(|(triangle, _)| middle(body.center(triangle)))
            .map(|(_, &weight)| weight)
            .collect();
        let mean = weights.iter().sum::<f64>() / weights.len() as f64;
        if weight > 0.0 {
            // By symmetry the middle runs along v. The gap there is cos 40° = 0.77 of a stroke.
            assert!(mean_angle(&body, &field, |_| v, middle) < 6.0);
            assert!(mean > weight && mean < 0.85, "{mean}");
        } else {
            // Perpendicular strokes cancel.
            assert!(mean < 0.2, "{mean}");
            assert!(field.coverage < 0.9, "{}", field.coverage);
        }
    }
}

#[test]
fn rings_of_strokes_run_around_a_cylinder() {
    let body = Body::binary(cube(31), |p| p.coords.xy().norm() - 18.0);
    let ring = |z: f64| -> Vec<[f64; 3]> {
        let at = |n: usize| (n as f64 * 15f64.to_radians()).sin_cos();
        (0..=24).map(at).map(|(sin, cos)| [18.0 * cos, 18.0 * sin, z]).collect()
    };
    let field = |rings: &[Vec<[f64; 3]>]| {
        let strokes = Strokes::from_points("rings", rings).unwrap();
        SkinField::new(&body.skin(), &Directions::Strokes(strokes)).unwrap()
    };
    let around = |p: Point3<f64>| Vector3::new(-p.y, p.x, 0.0).normalize();
    let found = field(&[ring(-20.0), ring(20.0)]);
    assert_tangent(&found);
    let error = mean_angle(&body, &found, around, |p| p.z.abs() < 24.0);
    assert!(error < 3.0 && found.coverage > 0.99, "{error} {}", found.coverage);
    // A short stroke says nothing about the sides, where its direction is the normal.
    let short = field(&[ring(0.0)[..2].to_vec()]);
    assert!(short.coverage > 0.3 && short.coverage < 0.8, "{}", short.coverage);
}

#[test]
fn parts_without_a_stroke_have_no_weight() {
    let lattice = cube(31);
    let slabs = |p: Point3<f64>| (p.x.abs() - 20.0).abs() - 5.0;
    let grid = *lattice.grid();
    let hu: Vec<f32> =
        (0..grid.len()).map(|p| if slabs(grid.mm(grid.point(p))) <= 0.0 { 40.0 } else { -1000.0 }).collect();
    let vertices: Vec<bool> = hu.iter().map(|&hu| hu > 0.0).collect();
    let found = Body::new(lattice.clone(), hu.clone(), SkinMode::Boundary);
    // Both slabs, although the largest component is one of them.
    let air: Vec<bool> = vertices.iter().map(|vertex| !vertex).collect();
    let options = cutis_mesh::SkinOptions::default();
    let triangles = cutis_mesh::skin::detect(&lattice, &air, SkinMode::Boundary, &options).unwrap().triangles;
    assert_eq!(triangles.len(), 2 * found.triangles.len());
    let body = Body { lattice, hu, vertices, triangles };
    let given = strokes(&[[Vector3::new(25.0, -9.0, 0.0), Vector3::new(25.0, 9.0, 0.0)]]);
    let field = SkinField::new(&body.skin(), &Directions::Strokes(given)).unwrap();
    assert_tangent(&field);
    for (triangle, &weight) in body.triangles.iter().zip(&field.weights) {
        // The stroke is on the outer face of the slab at x > 0, which is not connected with others.
        let expected = if body.center(triangle).x > 22.0 { 1.0 } else { 0.0 };
        assert!((weight - expected).abs() < 0.05, "{weight}");
    }
    assert!((field.coverage - 0.25).abs() < 0.01, "{}", field.coverage);
}

#[test]
fn strokes_that_leave_or_pierce_the_skin_are_refused() {
    let (body, [u, _]) = half_space(Vector3::z());
    let field = |strokes: Strokes| SkinField::new(&body.skin(), &Directions::Strokes(strokes));
    let above = |mm: f64| strokes(&[[u * -9.0, u * 9.0], [Vector3::z() * mm, Vector3::z() * mm + u * 6.0]]);
    assert!(field(above(5.0)).is_ok());
    let refused = field(above(9.0)).unwrap_err();
    assert!(matches!(refused, SkinError::StrokeOffSkin { point: 0, .. }), "{refused}");
    let text = refused.to_string();
    assert!(
        text.starts_with("test, stroke 1: ") && text.contains("9.0 mm") && text.contains("6.0 mm"),
        "{text}"
    );
    assert!(field(above(9.0).with_reach_mm(12.0).unwrap()).is_ok());
    assert!(field(above(5.0).with_reach_mm(4.0).unwrap()).is_err());
    for far in [1e30, 1e300, -1e308] {
        let long = strokes(&[[Vector3::zeros(), Vector3::repeat(far)]]);
        let refused = field(long).unwrap_err();
        assert!(matches!(refused, SkinError::StrokeOffSkin { .. }), "{refused}");
    }
    let deep = strokes(&[[Vector3::z() * 2.0, Vector3::z() * -3.0]]);
    let refused = field(deep).unwrap_err();
    assert!(matches!(refused, SkinError::StrokeThroughSkin { .. }), "{refused}");
    let long = strokes(&[[u * -9.0, u * 9.0]]);
    let no_skin = Body { triangles: Vec::new(), ..body };
    let refused = SkinField::new(&no_skin.skin(), &Directions::Strokes(long)).unwrap_err();
    assert!(matches!(refused, SkinError::StrokeOffSkin { distance_mm: f64::INFINITY, .. }), "{refused}");
    for reach in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = strokes(&[[u, -u]]).with_reach_mm(reach);
        assert!(matches!(refused, Err(SkinError::Distance { key: "reach_mm", .. })), "{reach}");
    }
}

#[test]
fn too_many_samples_are_refused() {
    let (body, [u, _]) = half_space(Vector3::z());
    let zigzag: Vec<[f64; 3]> =
        (0..1_000_000).map(|n| (u * if n % 2 == 0 { 23.0 } else { -23.0 }).into()).collect();
    let given = Strokes::from_points("zigzag", &[zigzag]).unwrap();
    let refused = SkinField::new(&body.skin(), &Directions::Strokes(given)).unwrap_err();
    assert!(matches!(refused, SkinError::StrokesTooLong { .. }), "{refused}");
}

#[test]
fn an_empty_skin_has_an_empty_field() {
    let body = Body { triangles: Vec::new(), ..Body::binary(cube(9), |p| p.z) };
    let field = SkinField::new(&body.skin(), &Directions::Along([0.0, 1.0, 0.0])).unwrap();
    assert_eq!((field.normals.len(), field.directions.len(), field.weights.len()), (0, 0, 0));
    assert_eq!((field.coverage, field.normals_from_facets), (0.0, 0));
    assert_eq!(field.cell_data(), cutis_skin::CellData::default());
}
