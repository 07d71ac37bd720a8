//! The local frame of meshes and solvers, in meters.

use cutis_volume::Grid;
use nalgebra::Point3;

/// Converts between local meters and world millimeters: `local_m = (world_mm − origin_mm) / 1000`.
///
/// The axes are RAS+ in both. An origin near the body keeps 32-bit coordinates precise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// World position of the local origin in mm.
    pub origin_mm: Point3<f64>,
}

impl Frame {
    /// The frame whose origin is the middle of a grid.
    pub fn center_of(grid: &Grid) -> Self {
        let middle = grid.shape.map(|n| n.saturating_sub(1) as f64 / 2.0);
        Self { origin_mm: grid.affine.to_mm(Point3::from(middle)) }
    }

    /// Converts local meters to world millimeters.
    pub fn to_mm(&self, local: Point3<f32>) -> Point3<f64> {
        self.origin_mm + local.coords.cast::<f64>() * 1000.0
    }

    /// Converts world millimeters to local meters.
    pub fn to_local(&self, mm: Point3<f64>) -> Point3<f32> {
        ((mm - self.origin_mm) / 1000.0).cast::<f32>().into()
    }
}
