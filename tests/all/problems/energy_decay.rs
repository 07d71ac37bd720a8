//! P9: the energy of an undamped body released from a strained shape never exceeds its initial
//! value. This holds for 10 000 steps with default settings on every backend.

use cutis_coloring::greedy;
use cutis_constraints::{
    Distance, Scalar, SkinTension, SkinTensionMaterial, Volume, distance_compliance, skin_compliance,
    volume_compliance,
};
use cutis_solver::{Settings, Solver, Stiffness, System, SystemBuilder, Values};
use cutis_test_kit::Kuhn;
use nalgebra::Point3;

use super::{Start, at_most, cpu, on_each_adapter, reference, scaled};

const SIZE: [usize; 3] = [4, 3, 3];
/// Spacing in m, Young's modulus and bulk modulus in Pa, area modulus of the skin in N/m, density
/// in kg/m³: soft tissue.
const SPACING: f64 = 0.01;
const YOUNGS_MODULUS: f64 = 1e4;
const BULK_MODULUS: f64 = 1e5;
const AREA_MODULUS: f64 = 50.0;
const DENSITY: f64 = 1000.0;
/// Allowed growth by rounding, relative to the initial energy.
const ROUNDING: f64 = 1e-3;

/// A block of tissue with skin on one side, stretched by a tenth and turning.
fn body<T: Scalar>() -> System<T> {
    let lattice = Kuhn::new(SIZE, SPACING);
    let count = lattice.positions.len();
    let volume = SPACING.powi(3);
    let lengths: Vec<f64> = lattice
        .edges
        .iter()
        .map(|&[a, b]| (lattice.positions[a as usize] - lattice.positions[b as usize]).norm())
        .collect();
    let share = volume / 7.0;
    let compliances = lengths.iter().map(|&l| distance_compliance(l, YOUNGS_MODULUS, share).unwrap());
    let springs = Stiffness::Compliance(Values::Each(compliances.map(T::constant).collect()));
    let solids = Stiffness::compliance(T::constant(volume_compliance(volume / 6.0, BULK_MODULUS).unwrap()));
    let skin: Vec<[u32; 3]> = lattice
        .tets
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, b, d], [a, c, d], [b, c, d]])
        .filter(|face| face.iter().all(|&v| lattice.positions[v as usize].z == 0.0))
        .collect();
    let area = SPACING * SPACING / 2.0;
    let pull = Stiffness::compliance(T::constant(skin_compliance(0.8 * area, AREA_MODULUS).unwrap()));
    let tension = SkinTensionMaterial { rest_area_scale: 0.8, amplification: 2.0 };
    let areas: Vec<[T; 2]> =
        vec![[T::constant(tension.rest_area_scale * area), T::constant(tension.amplification)]; skin.len()];
    let lengths: Vec<[T; 1]> = lengths.into_iter().map(|length| [T::constant(length)]).collect();
    let volumes = vec![[T::constant(volume / 6.0)]; lattice.tets.len()];
    let stretched: Vec<Point3<f64>> = scaled(&lattice.positions, 1.1);
    let spin = nalgebra::Vector3::new(2.0, -1.0, 3.0);
    let velocities: Vec<_> = stretched.iter().map(|p| spin.cross(&p.coords).map(T::constant)).collect();
    SystemBuilder::<T>::new(&stretched, &vec![1.0 / (DENSITY * volume); count])
        .unwrap()
        .velocities(&velocities)
        .unwrap()
        .add::<Distance, 2>(&lattice.edges, &lengths, springs, &greedy(&lattice.edges, count).unwrap())
        .unwrap()
        .add::<Volume, 4>(&lattice.tets, &volumes, solids, &greedy(&lattice.tets, count).unwrap())
        .unwrap()
        .add::<SkinTension, 3>(&skin, &areas, pull, &greedy(&skin, count).unwrap())
        .unwrap()
        .build()
}

/// Largest energy in each tenth of a run of `frames` frames, over the initial energy. Every
/// `stride` frames the energy is measured and velocities are multiplied by `pump`.
fn peaks<T: Scalar>(solver: &mut dyn Solver<T>, frames: usize, stride: usize, pump: f64) -> [f64; 10] {
    let start = solver.energy().unwrap().total_j();
    std::array::from_fn(|_| {
        let mut peak = 0.0_f64;
        for _ in 0..frames / 10 / stride {
            solver.step(stride).unwrap();
            peak = peak.max(solver.energy().unwrap().total_j() / start);
            if pump != 1.0 {
                let velocities =
                    solver.velocities().unwrap().iter().map(|v| v * T::constant(pump)).collect::<Vec<_>>();
                let (positions, frame) = (solver.positions().unwrap(), solver.simulation().clock().frame);
                solver.restore(&positions, &velocities, frame).unwrap();
            }
        }
        peak
    })
}

fn no_growth<T: Scalar>(start: &Start<T>, frames: usize, stride: usize, pump: f64) -> Result<(), String> {
    let peaks = peaks(&mut *start(body(), Settings::default()), frames, stride, pump);
    let mut before = 1.0;
    for peak in peaks {
        at_most("energy over that at the start", peak, before + ROUNDING)
            .map_err(|e| format!("{e}: {peaks:?}"))?;
        before = peak;
    }
    Ok(())
}

#[test]
fn energy_never_grows_on_the_cpu() {
    no_growth(&reference::<f64>, 10_000, 1, 1.0).unwrap();
    no_growth(&reference::<f32>, 10_000, 1, 1.0).unwrap();
    no_growth(&cpu::<f32>, 1000, 1, 1.0).unwrap();
    no_growth(&cpu::<f64>, 1000, 1, 1.0).unwrap();
}

/// Fewer frames than on the CPU, because software devices are slow. They make 10 000 substeps.
#[test]
fn energy_never_grows_on_the_gpu() {
    on_each_adapter(|start| no_growth(start, 500, 10, 1.0));
}

#[test]
fn control_a_body_that_is_driven_is_refused() {
    no_growth(&reference::<f64>, 1000, 1, 1.01).unwrap_err();
}
