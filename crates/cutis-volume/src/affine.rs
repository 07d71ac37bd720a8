//! The affine map from voxel index to RAS+ world millimeters.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::VolumeError;

/// An invertible affine map from continuous voxel index `(i, j, k)` to RAS+ world millimeters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Affine {
    /// World mm per index step, and the world position of index (0, 0, 0).
    to_mm: (Matrix3<f64>, Vector3<f64>),
    /// Index steps per mm, and the index of the world's origin.
    to_index: (Matrix3<f64>, Vector3<f64>),
}

impl Affine {
    /// Creates a map from the four rows of its homogeneous matrix, as NIfTI and nibabel write it.
    ///
    /// # Errors
    /// [`VolumeError::SingularAffine`] if a value is not finite, the last row is not `0 0 0 1`, or
    /// the matrix is not invertible.
    pub fn from_rows(rows: [[f64; 4]; 4]) -> Result<Self, VolumeError> {
        let finite = rows.iter().flatten().all(|v| v.is_finite()) && rows[3] == [0.0, 0.0, 0.0, 1.0];
        let steps = Matrix3::from_fn(|r, c| rows[r][c]);
        let origin = Vector3::from_fn(|r, _| rows[r][3]);
        let inverse = steps.try_inverse().filter(|_| finite).map(|inverse| (inverse, -(inverse * origin)));
        match inverse.filter(|(linear, offset)| linear.iter().chain(offset).all(|v| v.is_finite())) {
            Some(to_index) => Ok(Self { to_mm: (steps, origin), to_index }),
            None => Err(VolumeError::SingularAffine { rows: Box::new(rows) }),
        }
    }

    /// Creates an axis-aligned map: index axes along +R, +A and +S with steps of `spacing_mm`, and
    /// voxel (0, 0, 0) centered at `origin_mm`.
    ///
    /// # Errors
    /// [`VolumeError::SingularAffine`] if a spacing is zero or a value is not finite.
    pub fn from_spacing(spacing_mm: [f64; 3], origin_mm: [f64; 3]) -> Result<Self, VolumeError> {
        let [sx, sy, sz] = spacing_mm;
        let [ox, oy, oz] = origin_mm;
        Self::from_rows([[sx, 0.0, 0.0, ox], [0.0, sy, 0.0, oy], [0.0, 0.0, sz, oz], [0.0, 0.0, 0.0, 1.0]])
    }

    /// The four rows of the homogeneous matrix that maps index to mm.
    pub fn rows(&self) -> [[f64; 4]; 4] {
        let (steps, origin) = &self.to_mm;
        let row = |r: usize| [steps[(r, 0)], steps[(r, 1)], steps[(r, 2)], origin[r]];
        [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
    }

    /// World position of a continuous index in mm.
    #[inline]
    pub fn to_mm(&self, index: Point3<f64>) -> Point3<f64> {
        let (steps, origin) = &self.to_mm;
        Point3::from(steps * index.coords + origin)
    }

    /// Continuous index of a world position in mm.
    #[inline]
    pub fn to_index(&self, mm: Point3<f64>) -> Point3<f64> {
        let (steps, origin) = &self.to_index;
        Point3::from(steps * mm.coords + origin)
    }

    /// The step in mm from one voxel to the next along an index axis (column `axis` of the matrix).
    pub fn step_mm(&self, axis: usize) -> Vector3<f64> {
        self.to_mm.0.column(axis).into_owned()
    }

    /// Lengths of the three index steps in mm.
    pub fn spacing_mm(&self) -> [f64; 3] {
        std::array::from_fn(|axis| self.step_mm(axis).norm())
    }

    /// Signed volume of one voxel in mm³. It is negative if the index axes are left-handed.
    pub fn voxel_volume_mm3(&self) -> f64 {
        self.to_mm.0.determinant()
    }

    /// Largest |cosine| between two index axes: 0 if all are perpendicular.
    pub fn shear(&self) -> f64 {
        let axes: [Vector3<f64>; 3] = std::array::from_fn(|axis| self.step_mm(axis).normalize());
        [(0, 1), (0, 2), (1, 2)].map(|(a, b)| axes[a].dot(&axes[b]).abs()).into_iter().fold(0.0, f64::max)
    }

    /// True if the axes are not perpendicular, with a tolerance for headers that hold f32 or
    /// rounded decimals. A NIfTI qform cannot represent such a map. A gantry tilt of 0.01° exceeds
    /// the tolerance.
    pub fn is_sheared(&self) -> bool {
        self.shear() > 1e-4
    }

    /// The anatomical direction nearest to each index axis, such as `RAS`: `R`/`L`, `A`/`P` and
    /// `S`/`I`.
    pub fn orientation(&self) -> [char; 3] {
        let cosine = |world: usize, axis: usize| self.step_mm(axis)[world] / self.spacing_mm()[axis];
        let permutations = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
        let score = |worlds: &[usize; 3]| (0..3).map(|axis| cosine(worlds[axis], axis).abs()).sum::<f64>();
        // The first of equal scores wins, so that a tie at 45° has one answer.
        let best = permutations.into_iter().reduce(|a, b| if score(&b) > score(&a) { b } else { a });
        let worlds = best.unwrap_or([0, 1, 2]);
        std::array::from_fn(|axis| {
            let [positive, negative] = [['R', 'L'], ['A', 'P'], ['S', 'I']][worlds[axis]];
            if cosine(worlds[axis], axis) > 0.0 { positive } else { negative }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn linear(columns: [[f64; 3]; 3]) -> Affine {
        let row = |r: usize| [columns[0][r], columns[1][r], columns[2][r], 5.0];
        Affine::from_rows([row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]).unwrap()
    }

    #[test]
    fn orientation_names_the_nearest_direction() {
        assert_eq!(
            linear([[2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 3.0]]).orientation(),
            ['R', 'A', 'S']
        );
        assert_eq!(
            linear([[-2.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 3.0]]).orientation(),
            ['L', 'P', 'S']
        );
        assert_eq!(
            linear([[0.1, -9.0, 0.3], [0.2, 0.1, -1.0], [3.0, 0.5, 1.0]]).orientation(),
            ['P', 'I', 'R']
        );
        // Two axes are nearest to the same direction, but each direction is named once.
        assert_eq!(
            linear([[1.0, 0.9, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]).orientation(),
            ['A', 'R', 'S']
        );
    }

    #[test]
    fn shear_is_the_cosine_between_axes_for_any_spacing() {
        for scale in [1e-3, 1.0, 1e3] {
            let axes =
                |lean: f64| linear([[scale, 0.0, 0.0], [0.0, scale, 0.0], [0.0, lean * scale, 5.0 * scale]]);
            assert!((axes(0.5).shear() - 0.5 / 25.25f64.sqrt()).abs() < 1e-12);
            assert!(axes(0.5).is_sheared() && axes(-0.001).is_sheared() && !axes(1e-6).is_sheared());
        }
        let rotated = linear([[0.8, 0.6, 0.0], [-1.2, 1.6, 0.0], [0.0, 0.0, -7.0]]);
        assert!(rotated.shear() < 1e-15 && rotated.voxel_volume_mm3() < 0.0);
    }

    #[test]
    fn maps_without_an_inverse_are_refused() {
        for spacing in [[1.0, 0.0, 1.0], [1.0, f64::NAN, 1.0], [1.0, f64::INFINITY, 1.0]] {
            assert!(matches!(
                Affine::from_spacing(spacing, [0.0; 3]),
                Err(VolumeError::SingularAffine { .. })
            ));
        }
        let small = Affine::from_spacing([1e-60, 1e-60, 1e-60], [0.0; 3]).unwrap();
        let back = small.to_index(small.to_mm(Point3::new(1.0, 2.0, 3.0)));
        assert!((back - Point3::new(1.0, 2.0, 3.0)).norm() < 1e-14, "{back:?}");
    }
}
