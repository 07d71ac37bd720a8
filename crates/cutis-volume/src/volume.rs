//! A CT volume: int16 voxels with slope and intercept, on a [`Grid`].

use crate::{Grid, VolumeError};

/// Hounsfield value of air; padding below it is air too.
pub const AIR_HU: f32 = -1024.0;

/// A CT volume. Voxels stay int16; `HU = slope · stored + intercept`.
#[derive(Clone, Debug, PartialEq)]
pub struct Volume {
    grid: Grid,
    voxels: Vec<i16>,
    slope: f32,
    intercept: f32,
}

impl Volume {
    /// From voxels with index `i` fastest.
    ///
    /// # Errors
    /// [`VolumeError::VoxelCount`] if the number of voxels is not the product of the shape.
    pub fn new(grid: Grid, voxels: Vec<i16>, slope: f32, intercept: f32) -> Result<Self, VolumeError> {
        if voxels.len() != grid.len() {
            return Err(VolumeError::VoxelCount {
                shape: grid.shape,
                expected: grid.len(),
                found: voxels.len(),
            });
        }
        Ok(Self { grid, voxels, slope, intercept })
    }

    /// Where the voxel centres lie.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Stored values, index `i` fastest.
    pub fn voxels(&self) -> &[i16] {
        &self.voxels
    }

    /// Stored value → HU: `slope · stored + intercept`.
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
}
