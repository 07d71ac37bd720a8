//! Resampling a label map through a deformed mesh, with nearest neighbors.

use cutis_volume::{Grid, VolumeError};
use nalgebra::Vector3;

use crate::{Coverage, Displacement, ResampleError, Warp};

/// Counts of voxels in one resampling of a label map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LabelReport {
    /// Voxels whose center is in a deformed tet.
    pub covered_voxels: usize,
    /// Covered voxels whose place at rest is another one.
    pub moved_voxels: usize,
    /// Voxels of the rest shape that no deformed tet covers. They became background.
    pub vacated_voxels: usize,
}

/// Resamples a label map through a warp, on the same grid. `labels` has one value per point of the
/// grid, index `i` fastest, of any type.
///
/// A point that a deformed tet holds takes the label of the voxel nearest to its place at rest
/// (halves upwards), or `background` if that place is outside the grid. A point that the body has
/// left takes `background`. Any other point keeps its label. So labels are never mixed. The result
/// does not depend on the number of threads.
///
/// ```
/// use cutis_resample::{Warp, resample_labels};
/// use cutis_volume::{Affine, Grid};
/// use nalgebra::Point3;
///
/// let grid = Grid { shape: [4, 1, 1], affine: Affine::from_spacing([1.0; 3], [0.0; 3])? };
/// let rest = [[-1.0, -1.0, -1.0], [5.0, -1.0, -1.0], [-1.0, 5.0, -1.0], [-1.0, -1.0, 5.0]];
/// let rest = rest.map(|mm| Point3::from(mm.map(|c| c as f32 / 1000.0)));
/// let deformed = rest.map(|p| Point3::new(p.x + 0.0012, p.y, p.z));
/// let (origin_mm, tets) = (Point3::origin(), [[0, 1, 2, 3]]);
/// let warp = Warp { origin_mm, rest: &rest, deformed: &deformed, tets: &tets, body_tets: 1, removed: &[] };
/// let (warped, _) = resample_labels(&grid, &[7_u8, 200, 3, 9], 0, &warp, &|_, _| {})?;
/// assert_eq!(warped, [0, 7, 200, 3]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// The errors of [`resample`](crate::resample), and [`VolumeError::VoxelCount`] if there is not one
/// label per point.
pub fn resample_labels<T: Copy>(
    grid: &Grid,
    labels: &[T],
    background: T,
    warp: &Warp<'_>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<(Vec<T>, LabelReport), ResampleError> {
    let field = Displacement::to_rest(grid, warp)?;
    let (expected, found) = (grid.len(), labels.len());
    if found != expected {
        return Err(VolumeError::VoxelCount { shape: grid.shape, expected, found }.into());
    }
    let (mut warped, mut report) = (labels.to_vec(), LabelReport::default());
    field.for_each(progress, |slab| {
        for (n, (&coverage, &vector_mm)) in slab.coverage.iter().zip(&slab.vectors_mm).enumerate() {
            let index = slab.first + n;
            match coverage {
                Coverage::Outside => {}
                Coverage::Vacated => {
                    report.vacated_voxels += 1;
                    warped[index] = background;
                }
                Coverage::Inside => {
                    report.covered_voxels += 1;
                    if vector_mm != [0.0; 3] {
                        report.moved_voxels += 1;
                        let place = Vector3::from(grid.point(index)).map(|at| at as f64);
                        let rest = nearest(grid, place + field.voxels_of(vector_mm));
                        warped[index] = rest.map_or(background, |rest| labels[rest]);
                    }
                }
            }
        }
        Ok::<(), ResampleError>(())
    })?;
    Ok((warped, report))
}

/// The flat index of the nearest point of a grid, halves upwards. `None` outside of it.
fn nearest(grid: &Grid, place: Vector3<f64>) -> Option<usize> {
    let place = place.map(|at| (at + 0.5).floor());
    let inside = (0..3).all(|axis| place[axis] >= 0.0 && place[axis] < grid.shape[axis] as f64);
    inside.then(|| grid.index([0, 1, 2].map(|axis| place[axis] as usize)))
}
