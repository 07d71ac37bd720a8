//! A body for tests.

use cutis_constraints::{Distance, DistanceMaterial, Volume, VolumeMaterial};
use cutis_solver::{Stiffness, System, SystemBuilder};
use cutis_test_kit::Kuhn;
use nalgebra::Point3;

/// A block of springs and volumes whose bottom is held. It has several parts.
pub(crate) fn block() -> System<f64> {
    let Kuhn { positions, edges, tets, .. } = Kuhn::new([10, 10, 60], 0.01);
    let inverse_mass = |x: &Point3<f64>| if x.z < 0.005 { 0.0 } else { 1e3 };
    let inverse_masses: Vec<f64> = positions.iter().map(inverse_mass).collect();
    let colors = cutis_coloring::greedy(&edges, positions.len()).unwrap();
    let of_tets = cutis_coloring::greedy(&tets, positions.len()).unwrap();
    let stiffness = Stiffness::compliance(1e-2);
    SystemBuilder::<f64>::new(&positions, &inverse_masses)
        .unwrap()
        .add_from_rest::<Distance, 2>(&edges, &DistanceMaterial::default(), stiffness, &colors)
        .unwrap()
        .add_from_rest::<Volume, 4>(&tets, &VolumeMaterial::default(), Stiffness::compliance(1e-9), &of_tets)
        .unwrap()
        .build()
}
