//! Samples the HU of a volume at the points of a lattice, without aliasing.
//!
//! The filter along each axis is a tent. Its half-width is the lattice step, or one voxel if that
//! is more. The tents of neighboring lattice points overlap so that every voxel counts equally. On
//! the volume's own grid the filter returns each voxel unchanged. Padding (values below −1024 HU)
//! counts as −1024 before it is averaged. Points outside the volume are air.

mod aligned;
mod lattice;

pub use lattice::{LatticeSize, lattice_grid};

use nalgebra::{Point3, Vector3};

use crate::{Grid, Volume, VolumeError};

/// Filtered HU at each point of `grid`, index `i` fastest.
///
/// The axes of `grid` must be those of the volume, as in a grid from [`lattice_grid`]. On the
/// volume's own grid each value is that of the voxel, with padding as −1024. The work is parallel,
/// and the bits do not depend on the number of threads.
///
/// ```
/// use cutis_volume::{Affine, Grid, Volume, sample};
/// let affine = Affine::from_spacing([1.0; 3], [0.0; 3])?;
/// let volume = Volume::new(Grid { shape: [5, 5, 5], affine }, vec![40; 125], 1.0, 0.0)?;
/// let lattice = sample::lattice_grid(volume.grid(), "3,3,3".parse()?)?;
/// assert_eq!(sample::to_grid(&volume, &lattice)?, [40.0; 27]);
/// # Ok::<(), cutis_volume::VolumeError>(())
/// ```
///
/// # Errors
/// [`VolumeError::NotAligned`] if the axes of `grid` are not those of the volume.
pub fn to_grid(volume: &Volume, grid: &Grid) -> Result<Vec<f32>, VolumeError> {
    at_stops(volume, grid, grid.shape.map(|points| (0..points).map(Stop::even).collect()))
}

/// Filtered HU at the points of a lattice with uneven steps.
///
/// `planes` holds the positions of the lattice planes along each axis, ascending, in steps of
/// `grid`. The result has one value for each combination of planes, the first axis fastest. The
/// half-width of the tent at a plane is the mean of the steps to its two neighbors. If the planes
/// are those of `grid`, the result is bitwise that of [`to_grid`].
///
/// ```
/// use cutis_volume::{Affine, Grid, Volume, sample};
/// let affine = Affine::from_spacing([1.0; 3], [0.0; 3])?;
/// let volume = Volume::new(Grid { shape: [9, 9, 9], affine }, vec![40; 729], 1.0, 0.0)?;
/// let planes = [vec![0.0, 1.0, 2.5, 5.0, 8.0], vec![0.0, 8.0], vec![0.0, 4.0, 8.0]];
/// assert_eq!(sample::to_planes(&volume, volume.grid(), &planes)?, [40.0; 30]);
/// # Ok::<(), cutis_volume::VolumeError>(())
/// ```
///
/// # Errors
/// [`VolumeError::NotAligned`] if the axes of `grid` are not those of the volume.
pub fn to_planes(volume: &Volume, grid: &Grid, planes: &[Vec<f64>; 3]) -> Result<Vec<f32>, VolumeError> {
    at_stops(volume, grid, planes.each_ref().map(|planes| Stop::uneven(planes)))
}

fn at_stops(volume: &Volume, grid: &Grid, stops: [Vec<Stop>; 3]) -> Result<Vec<f32>, VolumeError> {
    let axes = IndexMap::new(volume.grid(), grid).axes(volume.grid(), &stops)?;
    Ok(aligned::sample(volume, axes, &stops))
}

/// A plane of lattice points across an axis, in steps of the grid.
#[derive(Clone, Copy)]
struct Stop {
    at: f64,
    /// Half-width of the tent.
    reach: f64,
}

impl Stop {
    fn even(n: usize) -> Self {
        Self { at: n as f64, reach: 1.0 }
    }

    fn uneven(planes: &[f64]) -> Vec<Self> {
        let step = |n: usize| planes.get(n + 1).map(|next| next - planes[n]);
        let stop = |n: usize| {
            let (before, after) = (n.checked_sub(1).and_then(step), step(n));
            let reach = match (before, after) {
                (Some(before), Some(after)) => (before + after) / 2.0,
                (Some(only), None) | (None, Some(only)) => only,
                (None, None) => 1.0,
            };
            Self { at: planes[n], reach }
        };
        (0..planes.len()).map(stop).collect()
    }
}

/// Affine map from grid index to voxel index.
struct IndexMap {
    origin: Point3<f64>,
    steps: [Vector3<f64>; 3],
}

impl IndexMap {
    fn new(voxels: &Grid, grid: &Grid) -> Self {
        let origin = voxels.affine.to_index(grid.affine.to_mm(Point3::origin()));
        let steps = std::array::from_fn(|axis| {
            let mut index = Point3::origin();
            index[axis] = 1.0;
            voxels.affine.to_index(grid.affine.to_mm(index)) - origin
        });
        Self { origin, steps }
    }

    /// Start and step along each axis, in voxels. The grids must share their axes to within a
    /// thousandth of a voxel at every point.
    fn axes(&self, voxels: &Grid, stops: &[Vec<Stop>; 3]) -> Result<[Axis; 3], VolumeError> {
        let last = |axis: usize| stops[axis].last().map_or(0.0, |stop| stop.at);
        for axis in 0..3 {
            for other in (0..3).filter(|&other| other != axis) {
                let drift_voxels = (self.steps[axis][other] * last(axis)).abs();
                if drift_voxels > 1e-3 {
                    return Err(VolumeError::NotAligned { axis, other, drift_voxels });
                }
            }
        }
        let axis = |a: usize| Axis {
            start: snap(self.origin[a], 1.0),
            step: snap(self.steps[a][a], (voxels.shape[a] as f64).max(last(a) + 1.0)),
            voxels: voxels.shape[a],
        };
        Ok([axis(0), axis(1), axis(2)])
    }
}

/// One axis of a grid: its stops lie at voxel `start + at · step`.
#[derive(Clone, Copy)]
struct Axis {
    start: f64,
    step: f64,
    voxels: usize,
}

/// Rounds `x` to a whole number if only rounding errors keep it from being one.
///
/// Affines are stored as f32 in files, and `reach` steps of `x` must not drift by a thousandth of a
/// voxel.
fn snap(x: f64, reach: f64) -> f64 {
    if (x - x.round()).abs() * reach.max(1.0) < 1e-3 { x.round() } else { x }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::{AIR_HU, Affine};

    fn volume(shape: [usize; 3], voxel: impl Fn([usize; 3]) -> i16) -> Volume {
        let rows =
            [[-0.7, 0.1, 0.0, 30.0], [0.0, 0.0, 3.1, -4.0], [0.1, 0.7, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0]];
        let grid = Grid { shape, affine: Affine::from_rows(rows).unwrap() };
        Volume::new(grid, (0..grid.len()).map(|n| voxel(grid.point(n))).collect(), 0.5, -24.0).unwrap()
    }

    fn noise([i, j, k]: [usize; 3]) -> i16 {
        ((i * 7919 + j * 104_729 + k * 1_299_709) % 4001) as i16 - 2000
    }

    fn lattice(volume: &Volume, vertices: [usize; 3]) -> Grid {
        lattice_grid(volume.grid(), LatticeSize::Vertices(vertices)).unwrap()
    }

    /// Applies the tent in three dimensions at once, in f64.
    fn oracle(volume: &Volume, grid: &Grid) -> Vec<f64> {
        let shape = volume.grid().shape;
        let step: [f64; 3] = std::array::from_fn(|a| (shape[a] - 1) as f64 / (grid.shape[a] - 1) as f64);
        let mean = |point: [usize; 3]| {
            let (mut sum, mut total) = (0.0, 0.0);
            for (n, &stored) in volume.voxels().iter().enumerate() {
                let voxel = volume.grid().point(n);
                let weight: f64 = (0..3)
                    .map(|a| {
                        (1.0 - (voxel[a] as f64 - point[a] as f64 * step[a]).abs() / step[a].max(1.0))
                            .max(0.0)
                    })
                    .product();
                sum += weight * f64::from(volume.hu(stored).max(AIR_HU));
                total += weight;
            }
            sum / total
        };
        (0..grid.len()).map(|n| mean(grid.point(n))).collect()
    }

    #[test]
    fn own_grid_gives_the_voxels_with_padding_as_air() {
        let volume = volume([9, 8, 7], |at| if at[0] == 2 { -6000 } else { noise(at) });
        let expected: Vec<f32> =
            volume.voxels().iter().map(|&stored| volume.hu(stored).max(-1024.0)).collect();
        assert!(expected.contains(&-1024.0));
        assert_eq!(to_grid(&volume, volume.grid()).unwrap(), expected);
        assert_eq!(to_grid(&volume, &lattice(&volume, [9, 8, 7])).unwrap(), expected);
    }

    #[test]
    fn a_uniform_volume_stays_uniform_and_outside_is_air() {
        let volume = volume([31, 17, 12], |_| 333);
        assert!(to_grid(&volume, &lattice(&volume, [10, 6, 29])).unwrap().iter().all(|&hu| hu == 142.5));
        let mut rows = volume.grid().affine.rows();
        rows[2][3] += 1000.0;
        let far = Grid { shape: [3; 3], affine: Affine::from_rows(rows).unwrap() };
        assert_eq!(to_grid(&volume, &far).unwrap(), [AIR_HU; 27]);
    }

    #[test]
    fn stripes_finer_than_the_lattice_become_their_mean() {
        let volume = volume([65, 9, 9], |[i, ..]| if i % 2 == 0 { 1000 } else { 0 });
        let hu = to_grid(&volume, &lattice(&volume, [17, 9, 9])).unwrap();
        let mean = 250.0 - 24.0;
        assert!(
            hu.chunks(17).all(|row| row[1..16].iter().all(|&hu| (hu - mean).abs() < 1e-3)),
            "{:?}",
            &hu[..17]
        );
        // Without a filter the lattice would read every fourth voxel, all of the same stripe.
        assert_eq!(volume.trilinear(Point3::new(4.0, 0.0, 0.0)), 476.0);
    }

    #[test]
    fn uneven_planes_reproduce_a_linear_field_and_even_planes_the_grid() {
        let linear = volume([30, 30, 30], |[i, j, k]| (10 * i + 20 * j + 30 * k) as i16);
        let grid = lattice(&linear, [15, 30, 12]);
        // The planes are even in the middle. At the sides of the volume the tents are cut off.
        let axis = |last: f64| vec![0.0, 3.0, 5.0, 6.0, 7.0, 8.0, 9.5, last];
        let planes = [axis(14.0), axis(29.0), axis(11.0)];
        let (hu, even) = (to_planes(&linear, &grid, &planes).unwrap(), to_grid(&linear, &grid).unwrap());
        let mut same = 0;
        for (n, hu) in hu.into_iter().enumerate() {
            let at = [n % 8, n / 8 % 8, n / 64];
            if at.iter().any(|&p| p == 0 || p == 7) {
                continue;
            }
            let index = Point3::from(std::array::from_fn::<f64, 3, _>(|a| planes[a][at[a]]));
            let voxel = linear.grid().affine.to_index(grid.affine.to_mm(index));
            let expected = 0.5 * (10.0 * voxel.x + 20.0 * voxel.y + 30.0 * voxel.z) - 24.0;
            assert!((f64::from(hu) - expected).abs() < 0.02 * expected, "{at:?}: {hu}, not {expected}");
            if at.iter().all(|&p| (3..=4).contains(&p)) {
                assert_eq!(hu, even[grid.index(at.map(|p| p + 3))]);
                same += 1;
            }
        }
        assert_eq!(same, 8);
        let all = grid.shape.map(|points| (0..points).map(|n| n as f64).collect());
        assert_eq!(to_planes(&linear, &grid, &all).unwrap(), even);
    }

    #[test]
    fn grids_with_other_axes_are_refused() {
        let volume = volume([30, 30, 30], noise);
        let mut grid = lattice(&volume, [10, 11, 12]);
        assert!(to_grid(&volume, &grid).is_ok());
        let mut rows = grid.affine.rows();
        rows[1][0] += 0.01;
        grid.affine = Affine::from_rows(rows).unwrap();
        let error = to_grid(&volume, &grid).unwrap_err();
        assert!(matches!(error, VolumeError::NotAligned { axis: 0, other: 2, .. }), "{error}");
        assert!(error.to_string().contains("lattice_grid"), "{error}");
    }

    #[test]
    fn bits_do_not_depend_on_the_number_of_threads() {
        let volume = volume([40, 30, 50], noise);
        for vertices in [[13, 17, 19], [50, 11, 7]] {
            let grid = lattice(&volume, vertices);
            let run = |threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| to_grid(&volume, &grid).unwrap())
            };
            let reference = run(1);
            assert!([2, 3, 8].into_iter().all(|threads| run(threads) == reference));
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]
        #[test]
        fn the_filter_equals_the_tent_in_three_dimensions(vertices in [2usize..20, 2usize..20, 2usize..20], shape in [2usize..14, 2usize..14, 2usize..14]) {
            let volume = volume(shape, noise);
            let grid = lattice(&volume, vertices);
            for (hu, expected) in to_grid(&volume, &grid).unwrap().into_iter().zip(oracle(&volume, &grid)) {
                prop_assert!((f64::from(hu) - expected).abs() < 2e-3, "{} not {}", hu, expected);
            }
        }
    }
}
