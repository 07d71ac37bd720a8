//! Voxels that the wall of a wound crosses hold the mean over the voxel.

use cutis_resample::{ResampleError, Warp, blend_walls, resample};
use cutis_volume::{Affine, Grid, Volume};
use nalgebra::{Point3, Vector3};

use crate::bodies::{lattice, noise, oblique};

const SIDE: usize = 24;
const TISSUE: i16 = 40;
const AIR: i16 = -1000;

/// A block that an oblique plane divides in two. The halves share no vertex.
struct Divided {
    origin_mm: Point3<f64>,
    rest: Vec<Point3<f32>>,
    tets: Vec<[u32; 4]>,
    /// Number of vertices of the first half.
    first: usize,
}

impl Divided {
    fn warp<'a>(&'a self, deformed: &'a [Point3<f32>]) -> Warp<'a> {
        Warp {
            origin_mm: self.origin_mm,
            rest: &self.rest,
            deformed,
            tets: &self.tets,
            body_tets: self.tets.len(),
            removed: &[],
        }
    }
}

/// The column in which the cut passes a voxel index.
fn cut_at(j: f64, k: f64) -> f64 {
    11.3 + 0.31 * (j - 11.5) - 0.17 * (k - 11.5)
}

fn divided(grid: &Grid) -> Divided {
    let full = (SIDE - 1) as f64;
    let mesh = lattice(grid, [6, 6, 6], [0.0; 3], [full; 3]);
    let to_index = |p: &Point3<f32>| grid.affine.to_index(mesh.origin_mm + p.coords.map(f64::from) * 1000.0);
    let local = |index: Point3<f64>| {
        Point3::from(((grid.affine.to_mm(index) - mesh.origin_mm) / 1000.0).map(|c| c as f32))
    };
    let half = |low: bool| {
        mesh.rest.iter().map(move |p| {
            let at = to_index(p);
            let (part, cut) = (at.x / full, cut_at(at.y, at.z));
            let column = if low { part * cut } else { cut + part * (full - cut) };
            local(Point3::new(column, at.y, at.z))
        })
    };
    let first = mesh.rest.len();
    let rest = half(true).chain(half(false)).collect();
    let second = mesh.tets.iter().map(|tet| tet.map(|v| v + first as u32));
    Divided {
        origin_mm: mesh.origin_mm,
        rest,
        tets: mesh.tets.iter().copied().chain(second).collect(),
        first,
    }
}

/// The scan: tissue, and one voxel of air, so that air has a stored value.
fn scan(grid: Grid) -> Volume {
    let mut voxels = vec![TISSUE; grid.len()];
    voxels[0] = AIR;
    Volume::new(grid, voxels, 1.0, 0.0).unwrap()
}

/// The share of the gap in each voxel, on a fine grid of points. The second half moved by `opening`
/// columns.
fn gap(grid: &Grid, opening: f64) -> Vec<f64> {
    const FINE: usize = 12;
    (0..grid.len())
        .map(|voxel| {
            let at = grid.point(voxel).map(|index| index as f64);
            let mut open = 0;
            for n in 0..FINE * FINE * FINE {
                let offset = [n % FINE, n / FINE % FINE, n / FINE / FINE];
                let [i, j, k] = [0, 1, 2].map(|axis| {
                    let point = at[axis] + (offset[axis] as f64 + 0.5) / FINE as f64 - 0.5;
                    point.clamp(0.0, (SIDE - 1) as f64)
                });
                let cut = cut_at(j, k);
                open += usize::from(i > cut && i < cut + opening);
            }
            open as f64 / (FINE * FINE * FINE) as f64
        })
        .collect()
}

#[test]
fn the_value_of_a_voxel_at_a_wall_is_the_share_of_the_tissue_in_it() {
    for affine in [Affine::from_spacing([1.0, 0.8, 1.3], [0.0; 3]).unwrap(), oblique()] {
        let grid = Grid { shape: [SIDE; 3], affine };
        let volume = scan(grid);
        let body = divided(&grid);
        for opening in [0.4, 1.0, 3.7] {
            let step: Vector3<f32> = (affine.step_mm(0) * (opening / 1000.0)).map(|c| c as f32);
            let mut deformed = body.rest.clone();
            deformed[body.first..].iter_mut().for_each(|p| *p += step);
            let warp = body.warp(&deformed);
            let at_walls: Vec<u32> = (0..body.tets.len() as u32).collect();
            let (sharp, _) = resample(&volume, &warp, &|_, _| {}).unwrap();
            let (smooth, count) = blend_walls(&volume, &warp, &at_walls, sharp.clone()).unwrap();
            let expected = gap(&grid, opening);
            let errors = |volume: &Volume| -> (f64, f64) {
                let open = |v: &i16| f64::from(TISSUE - v) / f64::from(TISSUE - AIR);
                let errors: Vec<f64> =
                    volume.voxels().iter().zip(&expected).skip(1).map(|(v, share)| open(v) - share).collect();
                let worst = errors.iter().fold(0.0_f64, |worst, error| worst.max(error.abs()));
                (worst, errors.iter().sum::<f64>() / expected.iter().sum::<f64>())
            };
            // The moved half leaves the grid at the far end, so its last columns are whole.
            let (worst, total) = errors(&smooth);
            assert!(worst < 0.07 && total.abs() < 0.005, "{opening}: worst {worst}, total {total}");
            let (worst, _) = errors(&sharp);
            assert!(worst > 0.4, "the control, one point per voxel: {worst}");
            assert!(count > 500 && smooth != sharp, "{count}");
        }
    }
}

/// HU grow along the columns. The wall that moved has the values of its place at rest.
#[test]
fn a_wall_takes_its_tissue_with_it() {
    const SLOPE: f64 = 20.0;
    const OPENING: f64 = 8.0;
    let grid = Grid { shape: [SIDE; 3], affine: oblique() };
    let voxels = (0..grid.len()).map(|n| (SLOPE * grid.point(n)[0] as f64) as i16).collect();
    let volume = Volume::new(grid, voxels, 1.0, 0.0).unwrap();
    let body = divided(&grid);
    let by = (grid.affine.step_mm(0) * (OPENING / 1000.0)).map(|c| c as f32);
    let moved = |(n, p): (usize, &Point3<f32>)| if n < body.first { *p } else { p + by };
    let deformed: Vec<_> = body.rest.iter().enumerate().map(moved).collect();
    let warp = body.warp(&deformed);
    let sharp = resample(&volume, &warp, &|_, _| {}).unwrap().0;
    let all: Vec<u32> = (0..body.tets.len() as u32).collect();
    let smooth = blend_walls(&volume, &warp, &all, sharp).unwrap().0;
    let (mut errors, mut control, mut count) = (0.0, 0.0, 0.0);
    for (voxel, gap) in gap(&grid, OPENING).into_iter().enumerate() {
        let [i, j, k] = grid.point(voxel).map(|index| index as f64);
        // Air is the lowest value, 0.
        if (0.2..0.8).contains(&gap) && i > cut_at(j, k) + OPENING / 2.0 {
            let value = f64::from(smooth.voxels()[voxel]);
            errors += (value - (1.0 - gap) * SLOPE * (i - OPENING)).abs();
            control += (value - (1.0 - gap) * SLOPE * i).abs();
            count += 1.0;
        }
    }
    assert!(count > 100.0 && errors / count < 15.0, "{} in {count} voxels", errors / count);
    assert!(control / count > 60.0, "the control, values of the place now: {}", control / count);
}

#[test]
fn a_body_that_did_not_move_keeps_all_values_and_so_do_voxels_away_from_walls() {
    let grid = Grid { shape: [SIDE; 3], affine: oblique() };
    let volume = noise(grid, 3);
    let body = divided(&grid);
    let warp = body.warp(&body.rest);
    let at_walls: Vec<u32> = (0..body.tets.len() as u32).collect();
    assert_eq!(blend_walls(&volume, &warp, &at_walls, volume.clone()).unwrap(), (volume.clone(), 0));

    // One half turns a little: only voxels at the cut, and at the sides that it left, are blended.
    let deformed: Vec<Point3<f32>> = body
        .rest
        .iter()
        .enumerate()
        .map(|(v, p)| if v < body.first { *p } else { p + Vector3::new(0.0, 2e-4, 1e-4) })
        .collect();
    let warp = Warp { deformed: &deformed, ..warp };
    let (sharp, _) = resample(&volume, &warp, &|_, _| {}).unwrap();
    let pool = |threads: usize| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let smooth = |threads: usize, at_walls: &[u32]| {
        pool(threads).install(|| blend_walls(&volume, &warp, at_walls, sharp.clone()).unwrap())
    };
    let one = smooth(1, &at_walls);
    assert_eq!(one, smooth(3, &at_walls), "the number of threads does not matter");
    assert!(one.1 > 100);
    assert_eq!(smooth(2, &[]), (sharp.clone(), 0), "no wall, no change");
}

#[test]
fn a_tet_that_has_burst_is_left_out() {
    let grid = Grid { shape: [SIDE; 3], affine: oblique() };
    let volume = scan(grid);
    let body = divided(&grid);
    let burst = body.tets.last().unwrap();
    // The voxels that are blended if a vertex of the last tet moves by a distance in meters.
    let blended = |distance: f32| {
        let mut deformed = body.rest.clone();
        deformed[burst[3] as usize] -= Vector3::from_element(distance);
        let warp = body.warp(&deformed);
        let (sharp, _) = resample(&volume, &warp, &|_, _| {}).unwrap();
        blend_walls(&volume, &warp, &[body.tets.len() as u32 - 1], sharp).unwrap().1
    };
    for distance in [1e3, 1e30, f32::MAX] {
        assert_eq!(blended(distance), 0, "{distance} m");
    }
    assert!(blended(2e-3) > 0, "the control, a tet that moved by a little");
}

#[test]
fn invalid_walls_are_refused() {
    let grid = Grid { shape: [8; 3], affine: oblique() };
    let volume = noise(grid, 1);
    let mesh = lattice(&grid, [2, 2, 2], [0.0; 3], [7.0; 3]);
    let warp = Warp {
        origin_mm: mesh.origin_mm,
        rest: &mesh.rest,
        deformed: &mesh.rest,
        tets: &mesh.tets,
        body_tets: mesh.tets.len(),
        removed: &[],
    };
    let tet = mesh.tets.len() as u32;
    let error = blend_walls(&volume, &warp, &[0, tet], volume.clone()).unwrap_err();
    assert!(matches!(error, ResampleError::NoSuchTet { tet: found, .. } if found == tet), "{error}");
    let other = noise(Grid { shape: [8, 8, 7], affine: oblique() }, 1);
    let error = blend_walls(&volume, &warp, &[0], other).unwrap_err();
    assert!(matches!(error, ResampleError::OtherGrid { expected: [8, 8, 8], found: [8, 8, 7] }), "{error}");
}
