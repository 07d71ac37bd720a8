//! Blocks of tetrahedra for the tests.

use cutis_coloring::greedy;
use cutis_constraints::{Distance, SkinTension, SkinTensionMaterial, Volume};
use cutis_solver::{Stiffness, System, SystemBuilder};
use cutis_test_kit::{Kuhn, Random};
use nalgebra::Point3;

/// The vertices of a lattice with springs on its edges and volumes in its tetrahedra, which are at
/// rest at `positions`.
pub fn solid(
    lattice: &Kuhn,
    positions: &[Point3<f64>],
    inverse_masses: &[f64],
    [spring, volume]: [f64; 2],
) -> SystemBuilder<f64> {
    let count = positions.len();
    SystemBuilder::new(positions, inverse_masses)
        .unwrap()
        .add_from_rest::<Distance, 2>(
            &lattice.edges,
            &Default::default(),
            Stiffness::compliance(spring),
            &greedy(&lattice.edges, count).unwrap(),
        )
        .unwrap()
        .add_from_rest::<Volume, 4>(
            &lattice.tets,
            &Default::default(),
            Stiffness::compliance(volume),
            &greedy(&lattice.tets, count).unwrap(),
        )
        .unwrap()
}

/// A block of `n³` vertices of 1 kg at a distance of `scale` meters, with a fixed top, springs of
/// 1 N/m, and volumes.
pub fn hanging(n: usize, scale: f64) -> System<f64> {
    let lattice = Kuhn::new([n; 3], scale);
    let top = (n - 1) as f64 * scale;
    let masses: Vec<f64> = lattice.positions.iter().map(|p| if p.z == top { 0.0 } else { 1.0 }).collect();
    hanging_at(n, scale, &lattice.positions, &masses)
}

/// The same block at rest at other positions, with other inverse masses.
pub fn hanging_at(n: usize, scale: f64, positions: &[Point3<f64>], inverse_masses: &[f64]) -> System<f64> {
    solid(&Kuhn::new([n; 3], scale), positions, inverse_masses, [1.0, scale.powi(4)]).build()
}

/// A block of all kinds of constraints with a fixed bottom and skin under tension on one side.
/// The distance between vertices is `scale` meters.
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
    solid(&lattice, &lattice.positions, &masses, [0.5, 0.1 * scale.powi(4)])
        .add_from_rest::<SkinTension, 3>(
            &skin,
            &SkinTensionMaterial { rest_area_scale: 0.8, amplification: 2.0 },
            Stiffness::compliance(0.5 * scale.powi(2)),
            &greedy(&skin, count).unwrap(),
        )
        .unwrap()
        .build()
}

/// A pseudo-random number from −1 to 1 that depends only on `n`.
pub fn noise(n: usize) -> f64 {
    Random::new(n as u64).between(-1.0, 1.0)
}

/// `x` with every coordinate displaced by up to `size`, except at vertices for which `held` is
/// true.
pub fn shaken(x: &[Point3<f64>], size: f64, held: impl Fn(usize) -> bool) -> Vec<Point3<f64>> {
    let moved = |(v, p): (usize, &Point3<f64>)| {
        if held(v) { *p } else { Point3::from([0, 1, 2].map(|axis| p[axis] + size * noise(3 * v + axis))) }
    };
    x.iter().enumerate().map(moved).collect()
}
