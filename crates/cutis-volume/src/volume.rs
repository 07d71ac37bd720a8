//! CT volumes: int16 voxels with slope and intercept, on a [`Grid`].

use nalgebra::Point3;
use ndarray::ArrayView3;

use crate::{Grid, VolumeError};

/// Hounsfield value of air. Lower values are padding and count as air.
pub const AIR_HU: f32 = -1024.0;

/// A CT volume. Voxels are stored as int16, with `HU = slope · stored + intercept`.
#[derive(Clone, Debug, PartialEq)]
pub struct Volume {
    grid: Grid,
    voxels: Vec<i16>,
    slope: f32,
    intercept: f32,
}

impl Volume {
    /// Creates a volume from voxels in flat order, index `i` fastest.
    ///
    /// # Errors
    /// [`VolumeError::VoxelCount`] if the number of voxels is not the product of the shape.
    /// [`VolumeError::Shape`] if that product is 0 or overflows. [`VolumeError::Scaling`] if slope
    /// or intercept is not finite, or the slope is 0.
    pub fn new(grid: Grid, voxels: Vec<i16>, slope: f32, intercept: f32) -> Result<Self, VolumeError> {
        let expected = grid.checked_len().ok_or(VolumeError::Shape { shape: grid.shape })?;
        if voxels.len() != expected {
            return Err(VolumeError::VoxelCount { shape: grid.shape, expected, found: voxels.len() });
        }
        if !slope.is_finite() || slope == 0.0 || !intercept.is_finite() {
            return Err(VolumeError::Scaling { slope, intercept });
        }
        Ok(Self { grid, voxels, slope, intercept })
    }

    /// The grid of the voxel centers.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Stored values in flat order, index `i` fastest.
    pub fn voxels(&self) -> &[i16] {
        &self.voxels
    }

    /// Stored values in flat order, index `i` fastest.
    pub fn into_voxels(self) -> Vec<i16> {
        self.voxels
    }

    /// Converts a stored value to HU: `slope · stored + intercept`.
    pub fn hu(&self, stored: i16) -> f32 {
        self.slope * f32::from(stored) + self.intercept
    }

    /// HU per stored unit.
    pub fn slope(&self) -> f32 {
        self.slope
    }

    /// HU of the stored value 0.
    pub fn intercept(&self) -> f32 {
        self.intercept
    }

    /// Views the stored values as an `ndarray` array, without a copy.
    ///
    /// The view has the shape of the grid and is indexed `[i, j, k]`: axis 0 is `i`, which varies
    /// fastest in memory, axis 2 is `k`. [`Volume::hu`] converts a stored value to HU.
    ///
    /// ```
    /// use cutis_volume::phantom;
    /// let ball = phantom::sphere([21, 25, 31], [1.0; 3], 8.0, 40)?;
    /// let view = ball.view();
    /// assert_eq!(view.dim(), (21, 25, 31));
    /// assert_eq!(view[[10, 12, 15]], 40);
    /// // Voxels above −449 HU in the middle axial slice.
    /// let slice = view.index_axis(ndarray::Axis(2), 15);
    /// let tissue = slice.iter().filter(|&&stored| ball.hu(stored) > -449.0).count();
    /// let circle = std::f64::consts::PI * 8.0 * 8.0;
    /// assert!((tissue as f64 / circle - 1.0).abs() < 0.05);
    /// # Ok::<(), cutis_volume::VolumeError>(())
    /// ```
    pub fn view(&self) -> ArrayView3<'_, i16> {
        self.grid.view(&self.voxels).expect("the constructor has compared shape and length")
    }

    /// HU at a continuous voxel index, by trilinear interpolation.
    ///
    /// The value at a voxel center is exactly that of the voxel. An index outside the volume is
    /// moved to the nearest point of the volume. The value at an index that is not finite is air.
    /// If some of the eight voxels are padding (below −1024 HU) and others are not, the padding
    /// counts as −1024.
    pub fn trilinear(&self, index: Point3<f64>) -> f32 {
        if !index.iter().all(|x| x.is_finite()) {
            return AIR_HU;
        }
        let [nx, ny, _] = self.grid.shape;
        let mut low = [0; 3];
        let mut fraction = [0.0; 3];
        for axis in 0..3 {
            let last = self.grid.shape[axis] - 1;
            let at = index[axis].clamp(0.0, last as f64);
            low[axis] = at as usize;
            fraction[axis] = at - low[axis] as f64;
        }
        // The last voxel along an axis has no next one.
        let step = |axis: usize, stride: usize| if fraction[axis] > 0.0 { stride } else { 0 };
        let steps = [step(0, 1), step(1, nx), step(2, nx * ny)];
        let base = self.grid.index(low);
        let mut hu: [f32; 8] = std::array::from_fn(|corner| {
            let offset: usize = (0..3).map(|axis| (corner >> axis & 1) * steps[axis]).sum();
            self.hu(self.voxels[base + offset])
        });
        without_padding(&mut hu);
        let mix = |a: f64, b: f64, t: f64| a + t * (b - a);
        let [x, y, z] = fraction;
        let along_x: [f64; 4] = std::array::from_fn(|row| mix(hu[2 * row].into(), hu[2 * row + 1].into(), x));
        mix(mix(along_x[0], along_x[1], y), mix(along_x[2], along_x[3], y), z) as f32
    }
}

/// Raises padding to air if some of the values are padding and others are not.
pub(crate) fn without_padding(hu: &mut [f32]) {
    if hu.iter().any(|&value| value >= AIR_HU) && hu.iter().any(|&value| value < AIR_HU) {
        hu.iter_mut().for_each(|value| *value = value.max(AIR_HU));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Affine;

    fn volume(shape: [usize; 3], voxel: impl Fn([usize; 3]) -> i16) -> Volume {
        let grid = Grid { shape, affine: Affine::from_spacing([1.0, 2.0, 3.0], [0.0; 3]).unwrap() };
        Volume::new(grid, (0..grid.len()).map(|n| voxel(grid.point(n))).collect(), 1.0, 0.0).unwrap()
    }

    #[test]
    fn trilinear_reproduces_a_linear_field_and_clamps() {
        let linear = volume([4, 3, 5], |[i, j, k]| (i + 10 * j + 100 * k) as i16);
        assert_eq!(linear.trilinear(Point3::new(1.25, 0.5, 3.75)), 1.25 + 5.0 + 375.0);
        assert_eq!(linear.trilinear(Point3::new(3.0, 2.0, 4.0)), 423.0);
        assert_eq!(linear.trilinear(Point3::new(-7.0, 1e300, 4.5)), 420.0);
        assert_eq!(linear.trilinear(Point3::new(f64::NAN, 0.0, 0.0)), AIR_HU);
        assert_eq!(linear.view()[[1, 2, 3]], 321);
    }

    #[test]
    fn padding_does_not_lower_the_value_of_tissue() {
        let padded = volume([3, 1, 1], |[i, ..]| [-3024, -3024, 40][i]);
        assert_eq!(padded.trilinear(Point3::new(1.0, 0.0, 0.0)), -3024.0);
        assert_eq!(padded.trilinear(Point3::new(0.5, 0.0, 0.0)), -3024.0);
        assert_eq!(padded.trilinear(Point3::new(1.5, 0.0, 0.0)), (-1024.0 + 40.0) / 2.0);
    }

    #[test]
    fn impossible_volumes_are_refused() {
        let affine = Affine::from_spacing([1.0; 3], [0.0; 3]).unwrap();
        let new = |shape, len, slope, intercept| {
            Volume::new(Grid { shape, affine }, vec![0; len], slope, intercept)
        };
        assert!(matches!(
            new([2, 2, 2], 7, 1.0, 0.0),
            Err(VolumeError::VoxelCount { expected: 8, found: 7, .. })
        ));
        assert!(matches!(new([0, 2, 2], 0, 1.0, 0.0), Err(VolumeError::Shape { .. })));
        assert!(matches!(new([usize::MAX, 2, 1], 1, 1.0, 0.0), Err(VolumeError::Shape { .. })));
        assert!(matches!(new([1, 1, 1], 1, 0.0, 0.0), Err(VolumeError::Scaling { .. })));
        assert!(matches!(new([1, 1, 1], 1, 1.0, f32::NAN), Err(VolumeError::Scaling { .. })));
        assert!(new([1, 1, 1], 1, -0.5, 3.0).is_ok());
    }
}
