//! A Kuhn lattice over a volume and volumes with deterministic contents, shared by tests and benches.
#![allow(dead_code, reason = "each test binary uses a part of it")]

use cutis_volume::{Affine, Grid, Volume};
use nalgebra::Point3;

/// Lattice mesh: rest positions in local meters, six tets per cell.
pub struct Mesh {
    pub origin_mm: Point3<f64>,
    pub rest: Vec<Point3<f32>>,
    pub tets: Vec<[u32; 4]>,
}

/// A lattice of `cells` cells over the box `low..=high` of continuous voxel indices; the origin is the box's first corner.
pub fn lattice(grid: &Grid, cells: [usize; 3], low: [f64; 3], high: [f64; 3]) -> Mesh {
    let origin_mm = grid.affine.to_mm(Point3::from(low));
    let n = cells.map(|c| c + 1);
    let mut rest = Vec::with_capacity(n.iter().product());
    for k in 0..n[2] {
        for j in 0..n[1] {
            for i in 0..n[0] {
                let part = |axis: usize, at: usize| {
                    low[axis] + (high[axis] - low[axis]) * at as f64 / cells[axis] as f64
                };
                let mm = grid.affine.to_mm(Point3::new(part(0, i), part(1, j), part(2, k)));
                rest.push(Point3::from(((mm - origin_mm) / 1000.0).map(|c| c as f32)));
            }
        }
    }
    let stride = [1, n[0], n[0] * n[1]];
    let paths = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let mut tets = Vec::with_capacity(6 * cells.iter().product::<usize>());
    for k in 0..cells[2] {
        for j in 0..cells[1] {
            for i in 0..cells[0] {
                let base = i + n[0] * (j + n[1] * k);
                for path in paths {
                    let a = base + stride[path[0]];
                    let b = a + stride[path[1]];
                    tets.push([base, a, b, b + stride[path[2]]].map(|v| v as u32));
                }
            }
        }
    }
    Mesh { origin_mm, rest, tets }
}

/// HU-like values in −1024…1976 that differ between all neighbors.
pub fn noise(grid: Grid, seed: u64) -> Volume {
    let value = |index: usize| {
        let mut x = (index as u64).wrapping_add(seed).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        x = (x ^ (x >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        ((x >> 33) % 3000) as i16 - 1024
    };
    Volume::new(grid, (0..grid.len()).map(value).collect(), 1.0, 0.0).unwrap()
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
