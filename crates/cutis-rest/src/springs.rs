//! A body for tests.

use std::ops::Range;

use cutis_constraints::{Distance, DistanceMaterial, Volume, VolumeMaterial};
use cutis_solver::{Stiffness, System, SystemBuilder, Values};
use cutis_test_kit::Kuhn;
use nalgebra::Point3;

/// A block of springs and volumes whose bottom is held. It has several parts.
pub(crate) fn block() -> System<f64> {
    block_of(Kuhn::new(CELLS, SPACING_M), |_| 1e-9)
}

/// A cube with a bulk modulus in Pa, most of whose vertices have neighbors on all sides.
pub(crate) fn cube_with_bulk_modulus(bulk_modulus_pa: f64) -> System<f64> {
    block_of(Kuhn::new([24; 3], SPACING_M), |volume_m3| volume_m3 / bulk_modulus_pa)
}

/// The block with a bulk modulus of 100 kPa, and with flat tetrahedra between two planes, as at the
/// walls of a cut: their vertices are between an edge and a three hundredth of it apart.
pub(crate) fn flat_block() -> System<f64> {
    let mut mesh = Kuhn::new(CELLS, SPACING_M);
    for (n, x) in mesh.positions.iter_mut().enumerate() {
        if (x.x - 0.05).abs() < 0.005 && FLAT_M.contains(&x.z) {
            x.x = 0.04 + SPACING_M * 10f64.powf(-2.5 * (12.9898 * n as f64).sin().abs());
        }
    }
    block_of(mesh, |volume_m3| volume_m3 / 1e5)
}

/// The height of the flat tetrahedra.
pub(crate) const FLAT_M: Range<f64> = 0.15..0.45;
const CELLS: [usize; 3] = [10, 10, 60];
pub(crate) const SPACING_M: f64 = 0.01;
pub(crate) const STIFFNESS_N_PER_M: f64 = 100.0;

/// Springs and volumes. `compliance` is that of a tetrahedron with a volume in m³.
fn block_of(mesh: Kuhn, compliance: impl Fn(f64) -> f64) -> System<f64> {
    let Kuhn { positions, edges, tets, .. } = mesh;
    let inverse_mass = |x: &Point3<f64>| if x.z < 0.005 { 0.0 } else { 1e3 };
    let inverse_masses: Vec<f64> = positions.iter().map(inverse_mass).collect();
    let colors = cutis_coloring::greedy(&edges, positions.len()).unwrap();
    let of_tets = cutis_coloring::greedy(&tets, positions.len()).unwrap();
    let springs = Stiffness::compliance(1.0 / STIFFNESS_N_PER_M);
    let of_tet = |tet: &[u32; 4]| {
        let [a, b, c, d] = tet.map(|v| positions[v as usize]);
        compliance((b - a).cross(&(c - a)).dot(&(d - a)).abs() / 6.0)
    };
    let volumes = Stiffness::Compliance(Values::Each(tets.iter().map(of_tet).collect()));
    SystemBuilder::<f64>::new(&positions, &inverse_masses)
        .unwrap()
        .add_from_rest::<Distance, 2>(&edges, &DistanceMaterial::default(), springs, &colors)
        .unwrap()
        .add_from_rest::<Volume, 4>(&tets, &VolumeMaterial::default(), volumes, &of_tets)
        .unwrap()
        .build()
}
