//! Directions around and along an axis.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::any_tangent;
use crate::SkinError;

/// Sines of the angle between axis and normal at which the weight is 0 and 1.
const FADE: [f64; 2] = [0.2, 0.5];

/// The axis with length 1.
pub(super) fn unit(key: &'static str, axis: [f64; 3]) -> Result<Vector3<f64>, SkinError> {
    let vector = Vector3::from(axis);
    let largest = vector.amax();
    if !vector.iter().all(|c| c.is_finite()) || largest == 0.0 {
        return Err(SkinError::Axis { key, axis });
    }
    // The largest component becomes 1, so that no square underflows or overflows.
    Ok((vector / largest).normalize())
}

/// `axis × n` at each normal, with its weight.
pub(super) fn around(axis: &Vector3<f64>, normals: &[Vector3<f64>]) -> Vec<(Vector3<f64>, f64)> {
    normals.par_iter().map(|normal| weighted(axis.cross(normal), normal)).collect()
}

/// The projection of the axis at each normal, with its weight.
pub(super) fn along(axis: &Vector3<f64>, normals: &[Vector3<f64>]) -> Vec<(Vector3<f64>, f64)> {
    normals.par_iter().map(|normal| weighted(axis - normal * normal.dot(axis), normal)).collect()
}

/// The unit vector and the weight of a vector whose length is the sine between axis and normal.
fn weighted(vector: Vector3<f64>, normal: &Vector3<f64>) -> (Vector3<f64>, f64) {
    let sine = vector.norm();
    let t = ((sine - FADE[0]) / (FADE[1] - FADE[0])).clamp(0.0, 1.0);
    let direction = if t > 0.0 { vector / sine } else { any_tangent(normal) };
    (direction, t * t * (3.0 - 2.0 * t))
}
