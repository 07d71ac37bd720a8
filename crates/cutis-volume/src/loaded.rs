//! A volume as it comes from a file, with facts about the file.

use crate::Volume;

/// A volume read from a file, with facts about the file.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The voxels with their grid and their scaling to HU.
    pub volume: Volume,
    /// Statistics of the HU in the file, before any conversion.
    pub stats: HuStats,
    /// Voxel type in the file by its NumPy name, such as `int16` or `float32`.
    pub dtype: &'static str,
    /// Unusual properties of the file and how they were interpreted.
    pub warnings: Vec<String>,
}

/// Statistics of all voxels that are neither NaN nor marked as padding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HuStats {
    /// Lowest value in HU. NaN if there is no value.
    pub min: f64,
    /// Highest value in HU. NaN if there is no value.
    pub max: f64,
    /// Sum of the values in HU.
    pub sum: f64,
    /// Number of NaN voxels. They become air (−1024 HU).
    pub nan_count: u64,
}
