//! HU at the points of another grid, anti-aliased, and the grids of lattices.
//!
//! The filter is a tent whose half-width along each axis of the grid is the grid's step, or one voxel where that is more: twice the
//! step covers every voxel evenly, and at the volume's own grid the tent leaves each voxel as it is.
//! Padding (below −1024 HU) counts as −1024 before anything is averaged, and points outside the volume are air.

mod aligned;
mod lattice;
mod oblique;

pub use lattice::{LatticeSize, lattice_grid};

use nalgebra::{Point3, Vector3};

use crate::{Grid, Volume};

/// HU at each point of `grid` (index `i` fastest), filtered as the module says. Where the grid is the volume's own, each value is
/// the voxel's (padding as −1024). Parallel; the same bits for any number of threads.
///
/// A grid whose axes are the volume's, as [`lattice_grid`] gives it, is filtered one axis after the other; any other one by
/// samples along its own axes.
///
/// ```
/// use cutis_volume::{Affine, Grid, Volume, sample};
/// let affine = Affine::from_spacing([1.0; 3], [0.0; 3])?;
/// let volume = Volume::new(Grid { shape: [5, 5, 5], affine }, vec![40; 125], 1.0, 0.0)?;
/// let lattice = sample::lattice_grid(volume.grid(), "3,3,3".parse()?)?;
/// assert_eq!(sample::to_grid(&volume, &lattice), [40.0; 27]);
/// # Ok::<(), cutis_volume::VolumeError>(())
/// ```
pub fn to_grid(volume: &Volume, grid: &Grid) -> Vec<f32> {
    at_stops(volume, grid, grid.shape.map(|points| (0..points).map(Stop::even).collect()))
}

/// HU at the points of planes that need not lie evenly: `planes` holds their positions along the three axes in steps of `grid`,
/// ascending. The result has a value for each combination of planes, the first axis fastest. Half the width of the tent around a
/// plane is the mean of the steps to its two neighbors. Where the planes are those of `grid`, the bits are those of [`to_grid`].
///
/// ```
/// use cutis_volume::{Affine, Grid, Volume, sample};
/// let affine = Affine::from_spacing([1.0; 3], [0.0; 3])?;
/// let volume = Volume::new(Grid { shape: [9, 9, 9], affine }, vec![40; 729], 1.0, 0.0)?;
/// let planes = [vec![0.0, 1.0, 2.5, 5.0, 8.0], vec![0.0, 8.0], vec![0.0, 4.0, 8.0]];
/// assert_eq!(sample::to_planes(&volume, volume.grid(), &planes), [40.0; 30]);
/// # Ok::<(), cutis_volume::VolumeError>(())
/// ```
pub fn to_planes(volume: &Volume, grid: &Grid, planes: &[Vec<f64>; 3]) -> Vec<f32> {
    at_stops(volume, grid, planes.each_ref().map(|planes| Stop::uneven(planes)))
}

fn at_stops(volume: &Volume, grid: &Grid, stops: [Vec<Stop>; 3]) -> Vec<f32> {
    let map = IndexMap::new(volume.grid(), grid);
    match map.aligned(volume.grid(), &stops) {
        Some(axes) => aligned::sample(volume, axes, &stops),
        None => oblique::sample(volume, &map, &stops),
    }
}

/// A plane of points across an axis, in steps of the grid.
#[derive(Clone, Copy)]
struct Stop {
    at: f64,
    /// Half the width of its tent.
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

/// Grid index → voxel index.
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

    /// Start and step along each axis, in voxels, if the grids share their axes to within a thousandth of a voxel everywhere.
    fn aligned(&self, voxels: &Grid, stops: &[Vec<Stop>; 3]) -> Option<[Axis; 3]> {
        let last = |axis: usize| stops[axis].last().map_or(0.0, |stop| stop.at);
        let strays = (0..3).any(|axis| {
            let reach = last(axis);
            (0..3).any(|other| other != axis && (self.steps[axis][other] * reach).abs() > 1e-3)
        });
        let axis = |a: usize| Axis {
            start: snap(self.origin[a], 1.0),
            step: snap(self.steps[a][a], (voxels.shape[a] as f64).max(last(a) + 1.0)),
            voxels: voxels.shape[a],
        };
        (!strays).then(|| [axis(0), axis(1), axis(2)])
    }
}

/// One axis of an aligned grid: its stops lie at voxel `start + at · step`.
#[derive(Clone, Copy)]
struct Axis {
    start: f64,
    step: f64,
    voxels: usize,
}

/// The whole number that `x` is meant to be, if rounding alone keeps it from it: affines are in f32 in a file, and `reach` steps
/// of it must not drift by a thousandth of a voxel.
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

    /// The tent in three dimensions at once, in f64.
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
        assert_eq!(to_grid(&volume, volume.grid()), expected);
        assert_eq!(to_grid(&volume, &lattice(&volume, [9, 8, 7])), expected);
    }

    #[test]
    fn what_is_uniform_stays_so_and_outside_is_air() {
        let volume = volume([31, 17, 12], |_| 333);
        assert!(to_grid(&volume, &lattice(&volume, [10, 6, 29])).iter().all(|&hu| hu == 142.5));
        let mut rows = volume.grid().affine.rows();
        rows[2][3] += 1000.0;
        let far = Grid { shape: [3; 3], affine: Affine::from_rows(rows).unwrap() };
        assert_eq!(to_grid(&volume, &far), [AIR_HU; 27]);
    }

    #[test]
    fn stripes_finer_than_the_lattice_become_their_mean() {
        let volume = volume([65, 9, 9], |[i, ..]| if i % 2 == 0 { 1000 } else { 0 });
        let hu = to_grid(&volume, &lattice(&volume, [17, 9, 9]));
        let mean = 250.0 - 24.0;
        assert!(
            hu.chunks(17).all(|row| row[1..16].iter().all(|&hu| (hu - mean).abs() < 1e-3)),
            "{:?}",
            &hu[..17]
        );
        // Without a filter every fourth voxel would be taken: all of them of the same stripe.
        assert_eq!(volume.trilinear(Point3::new(4.0, 0.0, 0.0)), 476.0);
    }

    #[test]
    fn both_paths_agree_where_the_step_is_whole() {
        let volume = volume([25, 13, 9], noise);
        let grid = lattice(&volume, [9, 5, 9]);
        let stops = grid.shape.map(|points| (0..points).map(Stop::even).collect());
        let turned = oblique::sample(&volume, &IndexMap::new(volume.grid(), &grid), &stops);
        let largest =
            to_grid(&volume, &grid).iter().zip(&turned).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(largest < 1e-2, "{largest} HU");
    }

    #[test]
    fn uneven_planes_read_a_linear_field_and_where_they_are_even_the_bits_of_the_grid() {
        let linear = volume([30, 30, 30], |[i, j, k]| (10 * i + 20 * j + 30 * k) as i16);
        let grid = lattice(&linear, [15, 30, 12]);
        // Even in the middle; the ends of a tent are cut off at the sides of the volume.
        let axis = |last: f64| vec![0.0, 3.0, 5.0, 6.0, 7.0, 8.0, 9.5, last];
        let planes = [axis(14.0), axis(29.0), axis(11.0)];
        let (hu, even) = (to_planes(&linear, &grid, &planes), to_grid(&linear, &grid));
        let mut same = 0;
        for (n, hu) in hu.into_iter().enumerate() {
            let at = [n % 8, n / 8 % 8, n / 64];
            if at.iter().any(|&p| p == 0 || p == 7) {
                continue;
            }
            let index = Point3::from(std::array::from_fn::<f64, 3, _>(|a| planes[a][at[a]]));
            let voxel = linear.grid().affine.to_index(grid.affine.to_mm(index));
            let right = 0.5 * (10.0 * voxel.x + 20.0 * voxel.y + 30.0 * voxel.z) - 24.0;
            assert!((f64::from(hu) - right).abs() < 0.02 * right, "{at:?}: {hu}, not {right}");
            if at.iter().all(|&p| (3..=4).contains(&p)) {
                assert_eq!(hu, even[grid.index(at.map(|p| p + 3))]);
                same += 1;
            }
        }
        assert_eq!(same, 8);
        let all = grid.shape.map(|points| (0..points).map(|n| n as f64).collect());
        assert_eq!(to_planes(&linear, &grid, &all), even);
    }

    #[test]
    fn a_turned_grid_reads_a_linear_field() {
        let volume = volume([30, 30, 30], |[i, j, k]| (10 * i + 20 * j + 30 * k) as i16);
        let rows =
            [[0.3, 0.9, 0.1, 18.0], [-0.9, 0.3, 0.4, 40.0], [0.1, -0.4, 0.9, 10.0], [0.0, 0.0, 0.0, 1.0]];
        let grid = Grid { shape: [3, 3, 3], affine: Affine::from_rows(rows).unwrap() };
        for (n, hu) in to_grid(&volume, &grid).into_iter().enumerate() {
            let at = volume.grid().affine.to_index(grid.mm(grid.point(n)));
            let right = 0.5 * (10.0 * at.x + 20.0 * at.y + 30.0 * at.z) - 24.0;
            assert!((f64::from(hu) - right).abs() < 1e-3, "{at:?}: {hu}, not {right}");
        }
    }

    #[test]
    fn bits_do_not_depend_on_threads() {
        let volume = volume([40, 30, 50], noise);
        for vertices in [[13, 17, 19], [50, 11, 7]] {
            let grid = lattice(&volume, vertices);
            let run = |threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| to_grid(&volume, &grid))
            };
            let reference = run(1);
            assert!([2, 3, 8].into_iter().all(|threads| run(threads) == reference));
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]
        #[test]
        fn the_filter_is_the_tent(vertices in [2usize..20, 2usize..20, 2usize..20], shape in [2usize..14, 2usize..14, 2usize..14]) {
            let volume = volume(shape, noise);
            let grid = lattice(&volume, vertices);
            for (hu, right) in to_grid(&volume, &grid).into_iter().zip(oracle(&volume, &grid)) {
                prop_assert!((f64::from(hu) - right).abs() < 2e-3, "{} not {}", hu, right);
            }
        }
    }
}
