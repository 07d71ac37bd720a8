//! Rotation of the person in the scanner.

use nalgebra::{Matrix3, Point3, Vector3};

/// A rotation about the origin that maps the person into the scanner: about the x axis first, then
/// about y, then about z. A positive angle turns as a right-handed screw.
pub(super) struct Turn {
    matrix: Matrix3<f64>,
}

impl Turn {
    /// The rotation by `degrees` about x, y and z. `None` if no axis turns.
    pub(super) fn new(degrees: [f64; 3]) -> Option<Self> {
        let about = |axis: usize| {
            let [sin, cos] = sin_cos(degrees[axis]);
            let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
            let mut matrix = Matrix3::identity();
            (matrix[(a, a)], matrix[(b, b)]) = (cos, cos);
            (matrix[(b, a)], matrix[(a, b)]) = (sin, -sin);
            matrix
        };
        let turns = degrees.iter().any(|degrees| degrees % 360.0 != 0.0);
        turns.then(|| Self { matrix: about(2) * about(1) * about(0) })
    }

    /// No rotation.
    #[cfg(test)]
    pub(super) fn identity() -> Self {
        Self { matrix: Matrix3::identity() }
    }

    /// The place in the scanner of a point of the upright person, in mm.
    pub(super) fn to_scanner(&self, point: [f64; 3]) -> [f64; 3] {
        (self.matrix * Vector3::from(point)).into()
    }

    /// The point of the upright person at a place in the scanner, in mm.
    pub(super) fn to_person(&self, place: [f32; 3]) -> [f32; 3] {
        let person = self.matrix.tr_mul(&Point3::from(place).coords.cast::<f64>());
        person.map(|c| c as f32).into()
    }
}

/// Sine and cosine of an angle in degrees, from operations that IEEE 754 specifies exactly. The
/// functions of the standard library may differ between machines.
fn sin_cos(degrees: f64) -> [f64; 2] {
    let within = degrees % 360.0;
    let quarters = (within / 90.0).round();
    let x = (within - 90.0 * quarters).to_radians();
    let square = x * x;
    // Taylor series, nested. At 45° the terms beyond x^17/17! are below 1e-17.
    let series = |first: i32| {
        (0..8).rev().fold(1.0, |sum, n| {
            let k = f64::from(first + 2 * n);
            1.0 - square / (k * (k + 1.0)) * sum
        })
    };
    let (sin, cos) = (x * series(2), series(1));
    match quarters.rem_euclid(4.0) as u8 {
        0 => [sin, cos],
        1 => [cos, -sin],
        2 => [-sin, -cos],
        _ => [-cos, sin],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_are_those_of_the_standard_library() {
        for degrees in (-1500..1500).map(|n| 0.73 * f64::from(n)) {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let [own_sin, own_cos] = sin_cos(degrees);
            assert!((own_sin - sin).abs() < 1e-14 && (own_cos - cos).abs() < 1e-14, "{degrees}°");
        }
        let quarters = [0.0, 90.0, 180.0, 270.0, 360.0, -90.0].map(sin_cos);
        assert_eq!(quarters, [[0.0, 1.0], [1.0, 0.0], [0.0, -1.0], [-1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]]);
    }

    #[test]
    fn turns_are_right_handed_and_x_comes_first() {
        let to = |degrees: [f64; 3], point: [f64; 3]| Turn::new(degrees).unwrap().to_scanner(point);
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(to([90.0, 0.0, 0.0], y), z);
        assert_eq!(to([0.0, 90.0, 0.0], z), x);
        assert_eq!(to([0.0, 0.0, 90.0], x), y);
        assert_eq!(to([90.0, 0.0, 90.0], y), z, "about x, and then about z");
        assert!(Turn::new([0.0, -360.0, 720.0]).is_none());
    }

    #[test]
    fn a_place_in_the_scanner_maps_back_to_its_point() {
        let turn = Turn::new([15.0, -40.0, 200.0]).unwrap();
        let place = turn.to_scanner([12.0, -70.0, 151.0]).map(|c| c as f32);
        for (found, wanted) in turn.to_person(place).into_iter().zip([12.0, -70.0, 151.0]) {
            assert!((found - wanted).abs() < 1e-4, "{found} instead of {wanted}");
        }
    }
}
