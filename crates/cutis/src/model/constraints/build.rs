//! Builds the system of a cut body: masses, the constraint kinds of the scene, handles.

use std::collections::{BTreeMap, HashSet};

use cutis_coloring::Groups;
use cutis_mesh::Stitch;
use cutis_solver::{Change, Formulation, Settings, SolverError, System, SystemBuilder};
use nalgebra::Vector3;

use super::ConstraintModel;
use super::coloring::Coloring;
use super::elements::Elements;
use super::hooks::{self, Hooks};
use super::kinds::{BodyParts, contact};
use super::threads::{self, Threads};
use super::wound::{self, GrowingWound, WholeParts};
use crate::Error;
use crate::body::GrowingCuts;
use crate::model::ModelInput;
use crate::scene::{Scene, SolverSection};

impl SolverSection {
    /// The solver settings that the section describes.
    pub(crate) fn settings(&self) -> Settings {
        Settings {
            formulation: self.formulation,
            dt_s: self.dt_s,
            substeps: self.substeps,
            iterations: self.iterations,
            gravity_m_s2: self.gravity_m_s2,
            damping_per_s: self.damping_per_s,
            relaxation: self.relaxation,
        }
    }
}

/// The solver settings of a scene. In a scan at rest a constant load balances the weight, so that
/// gravity moves nothing.
pub(crate) fn settings(scene: &Scene) -> Settings {
    let settings = scene.solver.settings();
    if scene.scan_is_at_rest { Settings { gravity_m_s2: [0.0; 3], ..settings } } else { settings }
}

/// Adds the load that balances the forces of all constraints in the scan, for vertex block descent.
/// The constraints of the other formulations hold the scan by themselves.
fn hold(system: &System<f32>, loads: &mut [Vector3<f32>]) -> Result<(), Error> {
    let forces = system.constraint_forces()?;
    loads.iter_mut().zip(forces).for_each(|(load, force)| *load -= force);
    Ok(())
}

/// Checks that no vertex is in two handles, one of which may grab it later than the other. The
/// error comes with the number of the handle.
fn check_handles(grabbed: &[Vec<u32>]) -> Result<(), (usize, SolverError)> {
    let mut held = HashSet::new();
    for (handle, vertices) in grabbed.iter().enumerate() {
        if let Some(&vertex) = vertices.iter().find(|vertex| !held.insert(**vertex)) {
            let reason = "is already moved by another handle";
            return Err((handle, SolverError::Handle { handle, vertex, reason }));
        }
    }
    Ok(())
}

impl ConstraintModel {
    /// Builds the parts that the scene names and no others.
    ///
    /// # Errors
    /// [`Error`] for a value of the scene that does not work with this body.
    pub(crate) fn build(input: &ModelInput<'_>) -> Result<Self, Error> {
        let ModelInput { file, scene, body } = *input;
        let inverse_masses = body.inverse_masses(file, &scene.fixed)?;
        // The frame's origin is in the middle of the CT, so a region of interest has the same
        // positions as in the whole body.
        let mut builder = SystemBuilder::<f32>::in_place(&body.mesh.positions, &inverse_masses)?;
        let grows = body.growing.is_some();
        let parts = BodyParts {
            file,
            solver: &scene.solver,
            until: scene.run.until,
            constraints: &scene.constraints,
            at_rest: scene.scan_is_at_rest,
            body,
            elements: if grows { Elements::Whole(body) } else { Elements::All(body) },
            inverse_masses: &inverse_masses,
            nothing_fixed: scene.fixed == Default::default(),
        };
        let (mut colors, mut colorings, mut warnings) = (BTreeMap::new(), BTreeMap::new(), Vec::new());
        let mut loads = vec![Vector3::zeros(); body.mesh.positions.len()];
        for (row, kind) in scene.constraints.named() {
            let section = format!("constraints.{}", row.key);
            let number;
            (builder, number) = kind.add(builder, &parts).map_err(file.blame(&section))?;
            colors.insert(row.key.to_owned(), number);
            colorings.insert(row.key.to_owned(), kind.coloring());
            if scene.scan_is_at_rest {
                kind.add_loads(&parts, &mut loads).map_err(file.blame(&section))?;
            }
            warnings.extend(kind.warnings(&parts));
        }
        if scene.solver.formulation == Formulation::Vbd {
            let mut colors = body.mesh.vertex_colors();
            if scene.constraints.joins_lips() {
                contact::separate(&mut colors, &body.mesh);
            }
            let stitches: Vec<&Stitch> = body.stitches.iter().flatten().collect();
            if !stitches.is_empty() {
                threads::separate(&mut colors, &body.mesh, &stitches);
            }
            builder = builder.vertex_groups(Groups::from_colors(&colors)?);
        }
        check_handles(&body.grabbed).map_err(|(n, error)| file.blame(&format!("handle[{n}]"))(error))?;
        let hooks = Hooks::new(&scene.handle, &body.grabbed, &scene.solver.settings());
        let holds = |n: usize| hooks.as_ref().is_none_or(|hooks| !hooks.waits(n));
        for (n, (section, grabbed)) in scene.handle.iter().zip(&body.grabbed).enumerate() {
            if holds(n) {
                let handle = hooks::handle(section, grabbed, section.at_s);
                builder = builder.handle(handle).map_err(file.blame(&format!("handle[{n}]")))?;
            }
        }
        let mut system = builder.build();
        let rounded = loads.iter().map(|load| load.map(|newton| newton as f32));
        let mut balanced: Vec<Vector3<f32>> = rounded.collect();
        if scene.scan_is_at_rest && scene.solver.formulation == Formulation::Vbd {
            hold(&system, &mut balanced)?;
        }
        system.set_loads(&balanced)?;
        let wound = match &body.growing {
            None => None,
            Some(cuts) => {
                let held =
                    (0..).zip(&body.grabbed).filter(|(n, _)| holds(*n)).flat_map(|(_, grabbed)| grabbed);
                let held = held.copied().collect();
                Some(add_wound(input, cuts, &mut system, &inverse_masses, &loads, &held)?)
            }
        };
        let mut threads = Threads::new(input, system.kinds().len())?;
        if let Some(threads) = &mut threads {
            let kind = threads.constraints(input)?;
            colors.insert("suture".to_owned(), kind.colors());
            colorings.insert("suture".to_owned(), Coloring::GreedyCpu);
            system.add_kinds(vec![kind])?;
        }
        Ok(Self { system, settings: settings(scene), colors, colorings, warnings, wound, threads, hooks })
    }
}

/// Adds the constraints along growing cuts, as they are at the start. `moved` are the vertices that
/// handles hold from the start.
fn add_wound(
    input: &ModelInput<'_>,
    cuts: &GrowingCuts,
    system: &mut System<f32>,
    inverse_masses: &[f32],
    loads: &[Vector3<f64>],
    moved: &HashSet<u32>,
) -> Result<GrowingWound, Error> {
    let ModelInput { file, scene, body } = *input;
    let fixed = body.fixed(file, &scene.fixed)?;
    let rest = wound::at_rest(&body.mesh.positions, inverse_masses);
    let whole = WholeParts {
        builder: SystemBuilder::in_place(&body.mesh.positions, inverse_masses)?,
        rest: &rest,
        kinds: system.kinds(),
        loads,
        inverse_masses,
        held: &|vertex| fixed[vertex as usize] || moved.contains(&vertex),
    };
    let (wound, parts) = GrowingWound::new(input, cuts, whole)?;
    system.add_kinds(parts.kinds)?;
    let nodes = || cuts.growth.nodes().iter().copied();
    system.change(&Change {
        inverse_masses: nodes().zip(parts.inverse_masses).collect(),
        loads: nodes().zip(parts.loads).collect(),
        ..Change::default()
    })?;
    Ok(wound)
}
