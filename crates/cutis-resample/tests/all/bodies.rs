//! Meshes and volumes for the tests.

use cutis_test_kit::{Kuhn, Random};
use cutis_volume::{Affine, Grid, Volume};
use nalgebra::Point3;

/// A lattice mesh with six tets per cell and rest positions in local meters.
pub struct Mesh {
    pub origin_mm: Point3<f64>,
    pub rest: Vec<Point3<f32>>,
    pub tets: Vec<[u32; 4]>,
}

/// A lattice of `cells` cells over the box `low..=high` of continuous voxel indices. The origin is
/// the first corner of the box.
pub fn lattice(grid: &Grid, cells: [usize; 3], low: [f64; 3], high: [f64; 3]) -> Mesh {
    let origin_mm = grid.affine.to_mm(Point3::from(low));
    let Kuhn { positions, tets, .. } = Kuhn::new(cells.map(|n| n + 1), 1.0);
    let local = |p: &Point3<f64>| {
        let index = [0, 1, 2].map(|a| low[a] + (high[a] - low[a]) * p[a] / cells[a] as f64);
        let mm = grid.affine.to_mm(Point3::from(index));
        Point3::from(((mm - origin_mm) / 1000.0).map(|c| c as f32))
    };
    Mesh { origin_mm, rest: positions.iter().map(local).collect(), tets }
}

/// A volume with random values from −1024 to 1975.
pub fn noise(grid: Grid, seed: u64) -> Volume {
    let mut random = Random::new(seed);
    let voxels = (0..grid.len()).map(|_| random.below(3000) as i16 - 1024).collect();
    Volume::new(grid, voxels, 1.0, 0.0).unwrap()
}

/// An oblique, left-handed, anisotropic affine whose numbers have no exact binary form.
pub fn oblique() -> Affine {
    let (s, c) = 0.3_f64.sin_cos();
    let step = [0.7, 1.1, 2.3];
    Affine::from_rows([
        [-c * step[0], s * step[1], 0.02, 113.7],
        [s * step[0], c * step[1], 0.1, -87.3],
        [0.01, -0.05, step[2], 412.9],
        [0.0, 0.0, 0.0, 1.0],
    ])
    .unwrap()
}
