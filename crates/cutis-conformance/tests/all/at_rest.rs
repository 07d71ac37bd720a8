//! A body that is at rest in the scan does not move, in any formulation on any backend: the two
//! constraints at rest are exactly zero there, in Rust and in WGSL.

use cutis_coloring::greedy;
use cutis_conformance::device;
use cutis_constraints::{
    Constraint, SkinStrip, SkinStripAtRest, SkinStripLaw, SkinStripMaterial, SkinStripTurn,
};
use cutis_solver::{
    Formulation, Settings, Solver, SolverError, SolverReference, Stiffness, System, SystemBuilder, Values,
};
use cutis_solver_cpu::SolverCpu;
use cutis_solver_gpu::SolverGpu;
use nalgebra::Point3;

/// Columns and rows of the sheet.
const SIZE: usize = 20;
const SPACING: f64 = 2e-3;

/// A sheet with heights that are not round, in two triangles per square.
fn sheet() -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
    let points = (0..SIZE * SIZE).map(|n| {
        let (i, j) = ((n % SIZE) as f64, (n / SIZE) as f64);
        let height = 0.3 * ((0.7 * i).sin() + (1.1 * j).cos());
        Point3::new(i * SPACING - 0.117, j * SPACING + 0.331, height * SPACING)
    });
    let square = |n: usize| n % SIZE + 1 < SIZE && n / SIZE + 1 < SIZE;
    let corners = |n: usize| [n, n + 1, n + SIZE, n + SIZE + 1].map(|v| v as u32);
    let triangles = (0..SIZE * SIZE).filter(|&n| square(n)).flat_map(|n| {
        let [a, b, c, d] = corners(n);
        [[a, b, d], [a, d, c]]
    });
    (points.collect(), triangles.collect())
}

/// A material for each triangle, with normals that change over the sheet.
fn material(triangle: usize) -> SkinStripMaterial {
    let law =
        SkinStripLaw { tension_n_per_m: 15.0, modulus_n_per_m: 60.0, stiffening: 4.0, compression: 0.2 };
    let turn = 0.01 * triangle as f64;
    SkinStripMaterial::new([0.2 * turn.sin(), 0.1 * turn.cos(), 1.0], [turn.cos(), turn.sin(), 0.0], law)
        .unwrap()
}

fn add<C: Constraint<3, Material = SkinStripMaterial>>(
    builder: SystemBuilder<f32>,
    formulation: Formulation,
) -> Result<SystemBuilder<f32>, SolverError> {
    let (points, triangles) = sheet();
    let corners = |triangle: &[u32; 3]| triangle.map(|v| points[v as usize]);
    let single = |x: [Point3<f64>; 3]| x.map(|p| p.map(|v| v as f32));
    let numbered = || triangles.iter().enumerate();
    let params: Vec<C::Params<f32>> =
        numbered().map(|(n, tuple)| C::from_rest(&single(corners(tuple)), &material(n))).collect();
    let compliance = numbered().map(|(n, tuple)| material(n).compliance(&corners(tuple)).unwrap() as f32);
    let stiffness = match formulation {
        Formulation::Pbd => Stiffness::Pbd(Values::Uniform(0.5)),
        Formulation::Xpbd | Formulation::Vbd => Stiffness::Compliance(Values::Each(compliance.collect())),
    };
    let groups = greedy(&triangles, points.len()).unwrap();
    builder.add::<C, 3>(&triangles, &params, stiffness, &groups)
}

/// The builder keeps the positions as they are. With [`SystemBuilder::new`] it may subtract a
/// center, and the parameters must then come from the positions after that.
fn builder() -> SystemBuilder<f32> {
    let (points, _) = sheet();
    SystemBuilder::in_place(&points, &vec![1e5; points.len()]).unwrap()
}

fn at_rest(formulation: Formulation) -> System<f32> {
    let builder = add::<SkinStripAtRest>(builder(), formulation).unwrap();
    add::<SkinStripTurn>(builder, formulation).unwrap().build()
}

fn settings(formulation: Formulation, [substeps, iterations]: [u32; 2]) -> Settings {
    Settings { formulation, substeps, iterations, dt_s: 1.0 / 60.0, ..Settings::default() }
}

/// Number of coordinates that have changed after 20 frames.
fn moved(solver: &mut dyn Solver<f32>) -> usize {
    let start = solver.positions().unwrap();
    solver.step(20).unwrap();
    let end = solver.positions().unwrap();
    start
        .iter()
        .zip(&end)
        .flat_map(|(a, b)| (0..3).map(move |axis| (a[axis], b[axis])))
        .filter(|(a, b)| a != b)
        .count()
}

#[test]
fn a_body_at_rest_does_not_move() {
    let gpu = device::open().unwrap();
    for formulation in [Formulation::Pbd, Formulation::Xpbd, Formulation::Vbd] {
        for schedule in [[1, 1], [3, 2], [20, 4]] {
            let settings = settings(formulation, schedule);
            let system = || at_rest(formulation);
            let what = format!("{formulation:?} {schedule:?}");
            assert_eq!(moved(&mut SolverReference::new(system(), settings).unwrap()), 0, "{what}");
            assert_eq!(moved(&mut SolverCpu::new(system(), settings, Some(2)).unwrap()), 0, "{what}");
            if let Some(gpu) = &gpu {
                assert_eq!(moved(&mut SolverGpu::new(gpu, system(), settings).unwrap()), 0, "{what}");
            }
        }
    }
}

/// Control: strips without the load pull the sheet together.
#[test]
fn without_the_load_the_body_moves() {
    for formulation in [Formulation::Pbd, Formulation::Xpbd, Formulation::Vbd] {
        let system = add::<SkinStrip>(builder(), formulation).unwrap().build();
        let settings = settings(formulation, [3, 2]);
        assert!(moved(&mut SolverReference::new(system, settings).unwrap()) > SIZE * SIZE, "{formulation:?}");
    }
}
