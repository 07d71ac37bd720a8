//! A block with soft springs and a hundred times stiffer volume: pulled by a handle, and hanging
//! from one face.

use cutis_coloring::Groups;
use cutis_constraints::{Distance, Volume, distance_compliance, volume_compliance};
use cutis_solver::{Formulation, Handle, Settings, Stiffness, System, SystemBuilder, Values};
use nalgebra::distance;

use super::{Failure, Problem};
use cutis_test_kit::Kuhn;

/// Length of a lattice step in m.
const STEP: f64 = 0.01;
/// Modulus of the springs in Pa.
const YOUNG_PA: f64 = 1e4;
/// Bulk modulus in Pa.
const BULK_PA: f64 = 100.0 * YOUNG_PA;
/// Density in kg/m³.
const DENSITY: f64 = 1000.0;
/// Path of the handle over the length of the block.
const STRETCH: f64 = 0.2;

/// The face at x = 0 is fixed, and a handle pulls the opposite face away within six frames.
///
/// # Errors
/// The builder refuses the system. This does not happen, because the system is valid.
pub fn pulled(size: [usize; 3]) -> Result<Problem, Failure> {
    let face: Vec<u32> = (0..size.iter().product::<usize>())
        .filter(|n| n % size[0] == size[0] - 1)
        .map(|n| n as u32)
        .collect();
    let length = (size[0] - 1) as f64 * STEP;
    let handle = Handle { vertices: face, move_m: [STRETCH * length, 0.0, 0.0], at_s: 0.0, over_s: 0.1 };
    Ok(Problem {
        name: "block",
        what: format!(
            "a block of {} × {} × {} vertices, E = {YOUNG_PA} Pa, K = {BULK_PA} Pa, one face fixed, the opposite one pulled away \
             by {} % of the length within 0.1 s",
            size[0],
            size[1],
            size[2],
            100.0 * STRETCH
        ),
        xpbd: system(size, Some(handle))?,
        vbd: None,
        pbd: None,
        settings: settings(),
        instants: vec![2, 4],
        compared_at: 5,
        most_frames: 60,
        opening: None,
        few_settings: false,
    })
}

/// The block hangs from the face at x = 0.
///
/// # Errors
/// The builder refuses the system. This does not happen, because the system is valid.
pub fn hanging(size: [usize; 3]) -> Result<Problem, Failure> {
    Ok(Problem {
        name: "hanging",
        what: format!(
            "the same block of {} × {} × {} vertices, hanging from the fixed face under its own weight",
            size[0], size[1], size[2]
        ),
        xpbd: system(size, None)?,
        settings: Settings { gravity_m_s2: [9.81, 0.0, 0.0], ..settings() },
        // Large substeps of descent damp the motion, so that a hanging body comes to rest slowly.
        most_frames: 150,
        ..pulled(size)?
    })
}

fn settings() -> Settings {
    Settings { formulation: Formulation::Xpbd, dt_s: 1.0 / 60.0, damping_per_s: 15.0, ..Settings::default() }
}

fn system(size: [usize; 3], handle: Option<Handle>) -> Result<System<f32>, Failure> {
    let lattice = Kuhn::new(size, STEP);
    let volume = STEP.powi(3) / 6.0;
    let mut masses = vec![0.0; lattice.positions.len()];
    let mut around = vec![0.0; lattice.edges.len()];
    let numbers: std::collections::HashMap<[u32; 2], usize> =
        lattice.edges.iter().enumerate().map(|(n, &edge)| (edge, n)).collect();
    for tet in &lattice.tets {
        for (n, &a) in tet.iter().enumerate() {
            masses[a as usize] += DENSITY * volume / 4.0;
            for &b in &tet[..n] {
                around[numbers[&[a.min(b), a.max(b)]]] += volume / 6.0;
            }
        }
    }
    let held = |n: usize| n.is_multiple_of(size[0]);
    let inverse_masses: Vec<f64> =
        masses.iter().enumerate().map(|(n, mass)| if held(n) { 0.0 } else { 1.0 / mass }).collect();
    let mut springs = Vec::with_capacity(lattice.edges.len());
    for (&[a, b], &share) in lattice.edges.iter().zip(&around) {
        let length = distance(&lattice.positions[a as usize], &lattice.positions[b as usize]);
        springs.push(distance_compliance(length, YOUNG_PA, share)? as f32);
    }
    let stiff = Stiffness::compliance(volume_compliance(volume, BULK_PA)? as f32);
    let springs = Stiffness::Compliance(Values::Each(springs));
    let (edge_groups, tet_groups) =
        (Groups::from_colors(&lattice.edge_colors)?, Groups::from_colors(&lattice.tet_colors)?);
    let builder = SystemBuilder::<f32>::new(&lattice.positions, &inverse_masses)?
        .add_from_rest::<Distance, 2>(&lattice.edges, &Default::default(), springs, &edge_groups)?
        .add_from_rest::<Volume, 4>(&lattice.tets, &Default::default(), stiff, &tet_groups)?;
    Ok(match handle {
        Some(handle) => builder.handle(handle)?,
        None => builder,
    }
    .build())
}
