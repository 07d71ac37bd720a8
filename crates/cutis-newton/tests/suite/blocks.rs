//! Blocks of tetrahedra for the tests and the benchmark.
#![allow(dead_code)] // each of them uses its own

use cutis_coloring::greedy;
use cutis_constraints::{
    Distance, DistanceMaterial, SkinTension, SkinTensionMaterial, Volume, VolumeMaterial,
};
use cutis_solver::{Stiffness, System, SystemBuilder};
pub use cutis_test_kit::Kuhn;
use nalgebra::Point3;

/// A block of `n³` vertices of 1 kg at `scale` meters from each other, whose top is held: springs of 1 N/m, volumes.
pub fn hanging(n: usize, scale: f64) -> System<f64> {
    let lattice = Kuhn::new([n; 3], scale);
    let top = (n - 1) as f64 * scale;
    let masses: Vec<f64> = lattice.positions.iter().map(|p| if p.z == top { 0.0 } else { 1.0 }).collect();
    hanging_at(n, scale, &lattice.positions, &masses)
}

/// The same with other positions, where it is at rest too, and inverse masses.
pub fn hanging_at(n: usize, scale: f64, positions: &[Point3<f64>], inverse_masses: &[f64]) -> System<f64> {
    let lattice = Kuhn::new([n; 3], scale);
    let count = positions.len();
    SystemBuilder::new(positions, inverse_masses)
        .unwrap()
        .add_from_rest::<Distance, 2>(
            &lattice.edges,
            &DistanceMaterial::default(),
            Stiffness::compliance(1.0),
            &greedy(&lattice.edges, count).unwrap(),
        )
        .unwrap()
        .add_from_rest::<Volume, 4>(
            &lattice.tets,
            &VolumeMaterial::default(),
            Stiffness::compliance(scale.powi(4)),
            &greedy(&lattice.tets, count).unwrap(),
        )
        .unwrap()
        .build()
}

/// A block of all kinds of constraints whose bottom is held; the skin on one side pulls. `scale` meters from vertex to vertex.
pub fn skinned(size: [usize; 3], scale: f64) -> System<f64> {
    let lattice = Kuhn::new(size, scale);
    let count = lattice.positions.len();
    let masses: Vec<f64> = lattice
        .positions
        .iter()
        .enumerate()
        .map(|(n, p)| if p.z == 0.0 { 0.0 } else { 1.0 + 0.1 * (n % 3) as f64 })
        .collect();
    let skin: Vec<[u32; 3]> = lattice
        .tets
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, b, d], [a, c, d], [b, c, d]])
        .filter(|face| face.iter().all(|&v| lattice.positions[v as usize].x == 0.0))
        .collect();
    SystemBuilder::<f64>::new(&lattice.positions, &masses)
        .unwrap()
        .add_from_rest::<Distance, 2>(
            &lattice.edges,
            &DistanceMaterial::default(),
            Stiffness::compliance(0.5),
            &greedy(&lattice.edges, count).unwrap(),
        )
        .unwrap()
        .add_from_rest::<Volume, 4>(
            &lattice.tets,
            &VolumeMaterial::default(),
            Stiffness::compliance(0.1 * scale.powi(4)),
            &greedy(&lattice.tets, count).unwrap(),
        )
        .unwrap()
        .add_from_rest::<SkinTension, 3>(
            &skin,
            &SkinTensionMaterial { rest_area_scale: 0.8, amplification: 2.0 },
            Stiffness::compliance(0.5 * scale.powi(2)),
            &greedy(&skin, count).unwrap(),
        )
        .unwrap()
        .build()
}

/// A number from −1 to 1 that depends on `n` without pattern.
pub fn noise(n: usize) -> f64 {
    let mixed = (n as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    ((mixed ^ (mixed >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 11) as f64 / 2f64.powi(52) - 1.0
}

/// `x` with every coordinate off by up to `size`, but for vertices that `held` says are held.
pub fn shaken(x: &[Point3<f64>], size: f64, held: impl Fn(usize) -> bool) -> Vec<Point3<f64>> {
    let moved = |(v, p): (usize, &Point3<f64>)| {
        if held(v) { *p } else { Point3::from([0, 1, 2].map(|axis| p[axis] + size * noise(3 * v + axis))) }
    };
    x.iter().enumerate().map(moved).collect()
}
