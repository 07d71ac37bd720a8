//! Test volumes with closed forms: a sphere, and a sphere within a hollow sphere.

use rayon::prelude::*;

use super::{centered_grid, zeros};
use crate::{AIR_HU, Volume, VolumeError};

/// A ball of `hu_inside` in air. Its center is the middle of the grid and the origin of the world.
///
/// The voxels are `spacing_mm` apart along +x, +y and +z. At the surface their values are blended
/// linearly over about one voxel, so that the sum of their tissue shares is close to `4/3 π r³`.
///
/// # Errors
/// [`VolumeError::PhantomShape`] as for [`Phantom::new`](super::Phantom::new).
/// [`VolumeError::SphereRadii`] if the radius is not finite and positive.
/// [`VolumeError::SingularAffine`] if a spacing is zero or not finite.
///
/// ```
/// let ball = cutis_volume::phantom::sphere([40, 40, 40], [1.0; 3], 15.0, 50)?;
/// let tissue: f64 = ball.voxels().iter().map(|&hu| (f64::from(hu) + 1024.0) / 1074.0).sum();
/// let exact = 4.0 / 3.0 * std::f64::consts::PI * 15.0_f64.powi(3);
/// assert!((tissue / exact - 1.0).abs() < 0.01);
/// # Ok::<(), cutis_volume::VolumeError>(())
/// ```
pub fn sphere(
    shape: [usize; 3],
    spacing_mm: [f64; 3],
    radius_mm: f64,
    hu_inside: i16,
) -> Result<Volume, VolumeError> {
    concentric(shape, spacing_mm, &[radius_mm], hu_inside)
}

/// A ball of `hu_inside` with a hollow of air, and a second ball inside the hollow. All are
/// centered at the origin.
///
/// `radii_mm` holds the radii of the outer ball, the hollow and the inner ball, in decreasing
/// order. Only the outermost sphere is an exterior surface.
///
/// # Errors
/// The errors of [`sphere`], and [`VolumeError::SphereRadii`] if the radii do not decrease.
pub fn nested_spheres(
    shape: [usize; 3],
    spacing_mm: [f64; 3],
    radii_mm: [f64; 3],
    hu_inside: i16,
) -> Result<Volume, VolumeError> {
    concentric(shape, spacing_mm, &radii_mm, hu_inside)
}

/// Concentric balls around the origin, alternately of tissue and air from the outermost inwards.
fn concentric(
    shape: [usize; 3],
    spacing_mm: [f64; 3],
    radii_mm: &[f64],
    hu_inside: i16,
) -> Result<Volume, VolumeError> {
    let positive = radii_mm.iter().all(|r| r.is_finite() && *r > 0.0);
    if !positive || !radii_mm.is_sorted_by(|a, b| a > b) {
        return Err(VolumeError::SphereRadii { radii_mm: radii_mm.to_vec() });
    }
    let mut voxels = zeros(shape)?;
    let grid = centered_grid(shape, spacing_mm)?;
    let blend = grid.affine.spacing_mm().iter().sum::<f64>() / 3.0;
    let [nx, ny, _] = shape;
    let (air, inside) = (f64::from(AIR_HU), f64::from(hu_inside));
    voxels.par_chunks_mut(nx).enumerate().for_each(|(row, voxels)| {
        for (i, voxel) in voxels.iter_mut().enumerate() {
            let distance = grid.mm([i, row % ny, row / ny]).coords.norm();
            let cover = |radius: &f64| (0.5 + (radius - distance) / blend).clamp(0.0, 1.0);
            let tissue = radii_mm.iter().enumerate().fold(0.0, |tissue, (n, radius)| {
                let filling = if n % 2 == 0 { 1.0 } else { 0.0 };
                tissue + cover(radius) * (filling - tissue)
            });
            *voxel = (air + tissue * (inside - air)).round() as i16;
        }
    });
    Volume::new(grid, voxels, 1.0, 0.0)
}
