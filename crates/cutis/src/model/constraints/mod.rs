//! The model `pbd`: constraints over the lattice, which a solver projects.

mod build;
pub(crate) mod coloring;
mod elements;
mod estimate;
mod hooks;
pub(crate) mod kinds;
mod measure;
mod solver_run;
mod start;
mod threads;
mod wound;

use std::collections::BTreeMap;

use cutis_solver::{Change, Formulation, Settings, SolverError, StepProfile, System};

use super::costs::{lines_that_hold, sizes, unfinished_cuts, unfinished_handles, unfinished_sutures};
use super::{Model, ModelCosts, ModelInput, Started};
use crate::backend::{Chosen, Request, RestDevice};
use crate::output::report::{MemoryPart, Sizes};
use crate::run::clock::Clock;
use crate::scene::validate::Check;
use crate::scene::{RunEnd, Scene, TissueMaterials};
use crate::{CostReport, Error, Progress};

use coloring::Coloring;
pub(crate) use estimate::CostEstimate;
use hooks::Hooks;
pub(super) use kinds::contact::fill_default;
use solver_run::SolverRun;
pub(crate) use solver_run::rest_options;
use start::StartedSolver;
pub(crate) use start::{device_memory, start};
use threads::Threads;
use wound::GrowingWound;

/// A system of constraints and the settings to step it with.
pub(crate) struct ConstraintModel {
    pub(crate) system: System<f32>,
    pub(crate) settings: Settings,
    /// Colors by constraint kind.
    pub(crate) colors: BTreeMap<String, usize>,
    /// How they were found.
    colorings: BTreeMap<String, Coloring>,
    /// Warnings of the constraint kinds.
    warnings: Vec<String>,
    /// The cuts that grow; none if the scene has none.
    wound: Option<GrowingWound>,
    /// The threads of sutures; none if the scene has none.
    threads: Option<Threads>,
    /// The handles that grab tissue later; none if the scene has none.
    hooks: Option<Hooks>,
}

impl ConstraintModel {
    /// The system for a program that does not change it while the body moves: handles with an
    /// `at_s` hold their tissue from the start, too.
    ///
    /// # Errors
    /// The errors of the solver.
    pub(crate) fn unchanging(mut self) -> Result<Self, SolverError> {
        if let Some(hooks) = self.hooks.take() {
            self.system.change(&Change { handles: hooks.into_handles(), ..Change::default() })?;
        }
        Ok(self)
    }
}

/// Checks the sections of the constraint kinds.
pub(super) fn validate(scene: &Scene, check: &Check<'_>) -> Result<(), Error> {
    scene.constraints.named().try_for_each(|(_, kind)| kind.validate(scene, check))
}

impl Model for ConstraintModel {
    fn costs(&self, input: &ModelInput<'_>, request: Request) -> Result<ModelCosts, Error> {
        let (system, settings, scene) = (&self.system, &self.settings, input.scene);
        let blame = || input.file.blame("solver");
        let (mut estimate, backend, projections) = if scene.run.frames == 0 {
            let backend = request.settle_on_cpu(&scene.solver, "auto: the run has no frames");
            (CostEstimate::at_rest(system, settings).map_err(blame())?, backend, 0)
        } else {
            let mut estimate = CostEstimate::of(system, settings).map_err(blame())?;
            let work = estimate.work(system, settings, scene.run.frames);
            let backend = request.settle(input.file, &scene.solver, &work)?;
            estimate.add_threaded(&backend, system);
            (estimate, backend, work.projections)
        };
        let (colors, colorings) = match estimate.vertex_colors() {
            _ if scene.run.frames == 0 => Default::default(),
            Some(number) => {
                let vertices = || StepProfile::DESCENT.to_owned();
                let closed_form = (vertices(), Coloring::ClosedForm);
                (BTreeMap::from([(vertices(), number)]), BTreeMap::from([closed_form]))
            }
            None => (self.colors.clone(), self.colorings.clone()),
        };
        let motionless = system.vertices().iter().filter(|v| v.inverse_mass() == 0.0).count();
        let followers = match (&self.wound, &input.body.growing) {
            (Some(wound), Some(cuts)) => wound.followers(cuts),
            _ => 0,
        };
        let mut warnings = scene_warnings(scene);
        warnings.extend((motionless == 0).then(|| NOTHING_FIXED.to_owned()));
        warnings.extend(self.warnings.iter().cloned());
        warnings.extend(unfinished_handles(scene));
        warnings.extend(unfinished_sutures(scene));
        warnings.extend(input.body.growing.iter().flat_map(|cuts| unfinished_cuts(scene, cuts)));
        let mut device_memory = match scene.run.frames {
            0 => Vec::new(),
            _ => device_memory(&backend, system, settings),
        };
        if scene.run.until == RunEnd::Rest {
            let vertices = system.vertices().len() - motionless;
            let part = |bytes: usize| MemoryPart { part: MemoryPart::REST.into(), bytes };
            estimate.memory.push(part(vertices * cutis_rest::Body::SEARCH_BYTES_PER_VERTEX));
            device_memory.extend(backend.on_gpu().then(|| part(RestDevice::bytes(vertices))));
        }
        Ok(ModelCosts {
            device_memory,
            backend,
            sizes: Sizes {
                lip_pairs: scene.constraints.lip_pairs(input.body),
                ..sizes(input.body, motionless - input.body.removed_vertices() - followers)
            },
            colors,
            colorings,
            memory: estimate.memory,
            projections,
            left_out: left_out(scene),
            warnings,
        })
    }

    fn measure(
        self: Box<Self>,
        input: &ModelInput<'_>,
        backend: &Chosen,
        costs: CostReport,
        clock: &mut Clock<'_>,
    ) -> Result<CostReport, Error> {
        if input.scene.run.frames == 0 {
            return Ok(CostReport { time: "not measured: the run has no frames".into(), ..costs });
        }
        let measure = |_: &dyn Progress| measure::substeps(backend, self.system, self.settings, costs);
        clock.stage("time a substep", 0, measure).map_err(input.file.blame("solver"))
    }

    fn start<'a>(
        self: Box<Self>,
        input: &ModelInput<'a>,
        backend: &Chosen,
        clock: &mut Clock<'_>,
    ) -> Result<Started<'a>, Error> {
        let Self { system, settings, wound, threads, hooks, .. } = *self;
        let (solver, device) = if input.scene.run.frames == 0 {
            let solver = StartedSolver::resting(system, settings).map_err(input.file.blame("solver"))?;
            (solver, backend.open().map_err(input.file.blame("solver.backend"))?)
        } else if backend.on_gpu() {
            let start = |_: &dyn Progress| start(backend, system, settings);
            clock.stage_on("gpu", "start the GPU", 0, start).map_err(input.file.blame("solver.backend"))?
        } else {
            start(backend, system, settings).map_err(input.file.blame("solver"))?
        };
        let gpu = device.as_ref().map(|device| device.gpu().clone());
        let run = SolverRun { solver, wound, threads, hooks, gpu, rest_device: None, input: *input };
        Ok(Started { simulation: Box::new(run), device })
    }
}

/// Parts that the scene does not name, and that are therefore neither stored nor computed.
fn left_out(scene: &Scene) -> Vec<String> {
    let absent = kinds::KINDS.iter().filter(|row| (row.section)(&scene.constraints).is_none());
    let mut lines: Vec<String> = absent
        .map(|row| format!("{}: left out, with one constraint per {}", row.key, row.facts.element))
        .collect();
    if scene.materials.is_none() {
        lines.push("materials: each kind has one modulus for all elements".to_owned());
    } else if !scene.used_materials().is_some_and(TissueMaterials::name_depth) {
        lines
            .push("depth: no material depends on the depth below the skin, so it is not computed".to_owned());
    }
    if scene.run.frames == 0 {
        lines.push("groups of colors: no frame needs them".to_owned());
    } else if scene.solver.iterations == 1 {
        lines.push("multipliers: one iteration per substep needs none stored".to_owned());
    }
    lines
}

/// Warning about a body that nothing holds.
const NOTHING_FIXED: &str = "no vertex is fixed: nothing holds the body in its place, and a search for its state of \
                             rest may not end (section `fixed`)";

/// Warnings about parts of the scene that do not have the effect that they seem to have.
fn scene_warnings(scene: &Scene) -> Vec<String> {
    let gravity = scene.solver.gravity_m_s2 != [0.0; 3];
    let nothing_fixed = scene.fixed == Default::default();
    let adheres = scene.undermining.iter().any(|undermining| undermining.adheres);
    lines_that_hold(&[
        (scene.chainmail.is_some(), "chainmail has no effect with model = \"pbd\""),
        (
            scene.constraints == Default::default(),
            "no constraint kind is named: nothing holds the tissue together",
        ),
        (
            nothing_fixed && gravity && !scene.scan_is_at_rest,
            "gravity acts and nothing is fixed: the body will fall",
        ),
        (
            gravity && scene.scan_is_at_rest,
            "solver.gravity_m_s2 moves nothing: the scan is at rest under its weight (scan_is_at_rest)",
        ),
        (
            scene.constraints.contact.as_ref().is_some_and(|contact| contact.acts)
                && scene.incision.iter().all(|cut| cut.width_mm.is_some())
                && scene.undermining.is_empty()
                && scene.excision.is_empty(),
            "constraints.contact has no effect without an incision without width_mm",
        ),
        (
            scene.constraints.adhesion.is_some() && !adheres,
            "constraints.adhesion has no effect without an undermining with adheres = true",
        ),
        (
            scene.constraints.adhesion.is_none() && adheres,
            "undermining.adheres has no effect without constraints.adhesion",
        ),
        (
            scene.materials.is_some() && scene.solver.formulation == Formulation::Pbd,
            "materials have no effect with solver.formulation = \"pbd\", which has no moduli",
        ),
        (
            scene.materials.is_some()
                && scene.constraints.distance.is_none()
                && scene.constraints.volume.is_none(),
            "materials have no effect without constraints.distance and constraints.volume",
        ),
    ])
}
