//! Test bodies with every kind of constraint, formulation and storage layout.

use cutis_coloring::{Groups, greedy};
use cutis_constraints::{
    Distance, Scalar, SkinTension, SkinTensionMaterial, SkinTensionPaper, SkinTensionPaperMaterial, Volume,
};
use cutis_solver::{Formulation, Handle, Settings, Stiffness, System, SystemBuilder, Values};
use cutis_test_kit::Kuhn;
use nalgebra::Vector3;

/// Parts of a test body.
#[derive(Clone, Copy, Debug)]
pub struct Parts {
    pub formulation: Formulation,
    pub distance: bool,
    pub volume: bool,
    pub skin: bool,
    pub paper: bool,
    pub handle: bool,
    /// A constant force on each vertex.
    pub loads: bool,
    /// One stiffness per constraint instead of one for all.
    pub each: bool,
    /// Spacing of the lattice in m.
    pub step: f64,
}

impl Parts {
    pub fn all(formulation: Formulation) -> Self {
        let paper = formulation == Formulation::Pbd;
        let (distance, volume, skin, handle, loads, each) = (true, true, true, true, true, true);
        Self { formulation, distance, volume, skin, paper, handle, loads, each, step: 0.1 }
    }

    pub fn none(formulation: Formulation) -> Self {
        let (distance, volume, skin, handle, loads, paper) = (false, false, false, false, false, false);
        Self { formulation, distance, volume, skin, paper, handle, loads, each: true, step: 0.1 }
    }
}

/// Builds a body with one fixed face and different masses.
pub fn body<T: Scalar>(parts: Parts) -> System<T> {
    let lattice = Kuhn::new([12, 9, 7], parts.step);
    let count = lattice.positions.len();
    let masses: Vec<f64> = (0..count).map(|n| (n % 12).min(1) as f64 * (0.5 + (n % 7) as f64)).collect();
    let skin: Vec<[u32; 3]> = lattice.tets.iter().map(|&[a, b, c, _]| [a, b, c]).step_by(5).collect();
    // Each compliance scales with its power of the length, so that a scaled body moves the same
    // way.
    let stiffness = |count: usize, compliance: f64| {
        let value = |n: usize| if parts.each { (1 + n % 3) as f64 } else { 1.0 };
        let unit = match parts.formulation {
            Formulation::Pbd => 0.3,
            Formulation::Xpbd | Formulation::Vbd => compliance,
        };
        let values = match parts.each {
            true => Values::Each((0..count).map(|n| T::constant(unit * value(n))).collect()),
            false => Values::Uniform(T::constant(unit)),
        };
        match parts.formulation {
            Formulation::Pbd => Stiffness::Pbd(values),
            Formulation::Xpbd | Formulation::Vbd => Stiffness::Compliance(values),
        }
    };
    let groups = |tuples: &[[u32; 2]]| greedy(tuples, count).unwrap();
    let skin_groups: Groups = greedy(&skin, count).unwrap();
    let scale = parts.step / 0.1;
    let mut builder = SystemBuilder::<T>::new(&lattice.positions, &masses).unwrap();
    if parts.distance {
        let stiffness = stiffness(lattice.edges.len(), 1e-3);
        let groups = groups(&lattice.edges);
        builder = builder
            .add_from_rest::<Distance, 2>(&lattice.edges, &Default::default(), stiffness, &groups)
            .unwrap();
    }
    if parts.skin {
        let material = SkinTensionMaterial { rest_area_scale: 0.8, amplification: 2.0 };
        let stiffness = stiffness(skin.len(), 1e-5 * scale.powi(2));
        builder = builder.add_from_rest::<SkinTension, 3>(&skin, &material, stiffness, &skin_groups).unwrap();
    }
    if parts.paper {
        let material = SkinTensionPaperMaterial::for_stiffness(0.9, 0.8, 2.0).unwrap();
        let stiffness = stiffness(skin.len(), 0.0);
        builder =
            builder.add_from_rest::<SkinTensionPaper, 3>(&skin, &material, stiffness, &skin_groups).unwrap();
    }
    if parts.volume {
        let stiffness = stiffness(lattice.tets.len(), 1e-7 * scale.powi(4));
        let groups = greedy(&lattice.tets, count).unwrap();
        builder = builder
            .add_from_rest::<Volume, 4>(&lattice.tets, &Default::default(), stiffness, &groups)
            .unwrap();
    }
    if parts.loads {
        // Up to the weight of the vertices.
        let load = |n: usize| Vector3::new(1.0, 0.5, -1.0) * (scale * (n % 5) as f64);
        let loads: Vec<Vector3<T>> = (0..count).map(|n| load(n).map(T::constant)).collect();
        builder = builder.loads(&loads).unwrap();
    }
    if parts.handle {
        let move_m = [0.1 * scale, 0.2 * scale, 0.0];
        for row in 0..2 {
            let vertices = (0..count as u32).filter(|n| n % 12 == 11 && (n / 12) % 9 == 8 * row).collect();
            builder = builder.handle(Handle { vertices, move_m, at_s: 0.0, over_s: 0.03 }).unwrap();
        }
    }
    builder.build()
}

pub fn settings(parts: &Parts, iterations: u32) -> Settings {
    let Parts { formulation, step, .. } = *parts;
    let gravity_m_s2 = [0.0, -9.81 * step / 0.1, 0.0];
    let relaxation = if formulation == Formulation::Vbd { 1.3 } else { 1.0 };
    let fixed = Settings { dt_s: 0.01, substeps: 2, damping_per_s: 0.5, ..Settings::default() };
    Settings { formulation, iterations, gravity_m_s2, relaxation, ..fixed }
}
