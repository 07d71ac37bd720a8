//! The model `chainmail`: lattice points are linked to their neighbors, and follow a neighbor only
//! when a link reaches its limit.

mod build;
mod chainmail_run;
mod device;
pub(crate) mod section;
mod wound;

use std::collections::BTreeMap;

use cutis_chainmail::Chain;
use nalgebra::Vector3;

use super::costs::{lines_that_hold, sizes, unfinished_cuts, unfinished_handles};
use super::{Model, ModelCosts, ModelInput, Simulation, Started};
use crate::backend::{Chosen, Request};
use crate::output::report::{MemoryPart, Sizes};
use crate::run::clock::Clock;
use crate::scene::Scene;
use crate::{CostReport, Error, Progress};

use chainmail_run::ChainmailRun;

/// A chain over the lattice of a body. Its element numbers are those of lattice points.
pub(crate) struct ChainmailModel {
    chain: Chain,
    /// Element of each mesh vertex. A virtual vertex has that of the vertex at its lattice point.
    elements: Vec<u32>,
    handles: Vec<ChainHandle>,
    /// The cuts with a width, in the order in which they are made.
    cuts: Vec<ChainCut>,
    /// Vertices that do not move.
    fixed: usize,
    relax_per_frame: u32,
}

/// Elements that are dragged along a straight line, from the place where they are grabbed.
struct ChainHandle {
    elements: Vec<u32>,
    /// The first frame in which they are dragged.
    frame: u32,
    /// The whole path, in lattice steps.
    steps: Vector3<f64>,
    /// Duration of the movement, s.
    over_s: f64,
}

/// Links that an incision with a width cuts.
struct ChainCut {
    at_s: f64,
    links: Vec<[u32; 2]>,
}

impl Model for ChainmailModel {
    fn costs(&self, input: &ModelInput<'_>, request: Request) -> Result<ModelCosts, Error> {
        let (scene, body) = (input.scene, input.body);
        let part = |(part, bytes): (&str, usize)| MemoryPart { part: part.into(), bytes };
        let visits = [self.relax_per_frame, scene.run.frames]
            .iter()
            .fold(body.mesh.positions.len() as u64, |product, &n| product.saturating_mul(n.into()));
        let mut warnings = scene_warnings(scene);
        warnings.extend(unfinished_handles(scene));
        warnings.extend(body.growing.iter().flat_map(|cuts| unfinished_cuts(scene, cuts)));
        let reason = "auto: ChainMail propagates on the CPU, and relaxation on a GPU was not measured to be \
                      faster on any GPU";
        let backend = request.settle_on_cpu(&scene.solver, reason);
        Ok(ModelCosts {
            device_memory: device::memory(&backend, &self.chain),
            backend,
            sizes: Sizes { edges: self.chain.links(), ..sizes(body, self.fixed) },
            colors: BTreeMap::new(),
            colorings: BTreeMap::new(),
            memory: self.chain.bytes().map(part).into(),
            projections: visits,
            left_out: lines_that_hold(&[
                (
                    true,
                    "solver: no masses, no constraints and no substeps; of this section only dt_s, backend \
                     and threads have an effect",
                ),
                (self.relax_per_frame == 0, "relaxation: links stay where drags leave them"),
            ]),
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
        clock.stage("time a frame", 0, |_| {
            let mut run = ChainmailRun::new(input, *self, threads(backend), None)?;
            let mut times = cutis_solver::StepProfile::default();
            run.step_timed(&mut times)?;
            Ok(costs.with_times(&times, 1.0, "the first frame, on this machine as busy as it is now"))
        })
    }

    fn start<'a>(
        self: Box<Self>,
        input: &ModelInput<'a>,
        backend: &Chosen,
        clock: &mut Clock<'_>,
    ) -> Result<Started<'a>, Error> {
        let started = if backend.on_gpu() {
            let start = |_: &dyn Progress| device::start(backend, &self.chain);
            clock.stage_on("gpu", "start the GPU", 0, start).map_err(input.file.blame("solver.backend"))?
        } else {
            None
        };
        let (relaxer, device) = started.unzip();
        let run = ChainmailRun::new(input, *self, threads(backend), relaxer)
            .map_err(input.file.blame("solver.threads"))?;
        Ok(Started { simulation: Box::new(run), device })
    }
}

/// Threads on the host. The reference backend has none: it propagates by one queue on one thread.
fn threads(backend: &Chosen) -> Option<usize> {
    (!backend.is_reference()).then(|| backend.host_threads())
}

/// Warnings about parts of the scene that do not have the effect that they seem to have.
fn scene_warnings(scene: &Scene) -> Vec<String> {
    lines_that_hold(&[
        (scene.constraints != Default::default(), "constraints have no effect with model = \"chainmail\""),
        (
            scene.materials.is_some(),
            "materials have no effect with model = \"chainmail\", whose limits are in chainmail.materials",
        ),
        (
            scene.solver.gravity_m_s2 != [0.0; 3],
            "solver.gravity_m_s2 has no effect with model = \"chainmail\"",
        ),
        (
            scene.handle.is_empty(),
            "there is no handle: with model = \"chainmail\" nothing else moves the body",
        ),
    ])
}
