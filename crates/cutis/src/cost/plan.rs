//! What a scene will do, before it does it: sizes, colors, memory, what is left out, and which backend.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::backend::{self, Chosen, Request};
use crate::body::region;
use crate::body::{Body, needs_skin};
use crate::cost::cost_report;
use crate::ct::source::{self, Source};
use crate::model::Chained;
use crate::model::chainmail::chain::ChainBody;
use crate::model::constraints::system::{self as dynamics, Dynamics};
use crate::report::{Backend, MemoryPart, Sizes, Stage};
use crate::run::clock::Clock;
use crate::scene::{LoadedScene, Model};
use crate::{CostReport, Error, Progress};

use crate::cost::model_costs::{self as costs, Costs};

/// Why a plan has no times.
const NO_DEVICE: &str = "not measured: no device is opened for a plan; `cutis tune` measures on the GPU";

/// The plan of a scene, as `cutis check` prints it.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Plan {
    /// Where the solver will run.
    pub backend: Backend,
    /// Element counts.
    pub sizes: Sizes,
    /// Colors per constraint kind; in vertex block descent those of the vertices, as `descent`, and no others.
    pub colors: BTreeMap<String, usize>,
    /// Memory of the solver on the host by part, bytes.
    pub memory: Vec<MemoryPart>,
    /// Memory of the solver on the GPU by part, bytes; empty on a CPU backend. Each part has kernels of its own, and what has
    /// no part here has none.
    pub device_memory: Vec<MemoryPart>,
    /// Bytes and time of the solver by part.
    #[serde(rename = "ledger")]
    pub costs: CostReport,
    /// Bytes of the volume's voxels.
    pub volume_bytes: usize,
    /// Projections of the run, steps of a vertex in vertex block descent, or visits of an element by the relaxation of ChainMail, at
    /// the most; the largest 64-bit number where it is more.
    pub projections: u64,
    /// What the scene leaves out, and therefore costs nothing.
    pub left_out: Vec<String>,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// Time that planning took, by stage.
    pub stages: Vec<Stage>,
}

/// Everything that a run starts from.
pub(crate) struct Prepared {
    pub(crate) source: Source,
    pub(crate) body: Body,
    pub(crate) matter: Matter,
    pub(crate) backend: Chosen,
    pub(crate) plan: Plan,
}

/// What the model makes of the body.
pub(crate) enum Matter {
    Dynamics(Box<Dynamics>),
    Chain(Box<ChainBody>),
}

/// Plans a scene: reads the CT, builds the body and the system, opens no device and writes nothing. On a CPU backend it steps
/// the body for a moment, to tell what a frame would take.
///
/// # Errors
/// [`Error`] as a run of the scene would give it before its first frame.
pub fn check(loaded: &LoadedScene, progress: &dyn Progress) -> Result<Plan, Error> {
    let mut clock = Clock::new(progress);
    let Prepared { body, matter, backend, mut plan, .. } = prepare(loaded, Request::of(loaded)?, &mut clock)?;
    plan.costs = match matter {
        _ if backend.on_gpu() => plan.costs,
        Matter::Dynamics(dynamics) => {
            let Dynamics { system, settings, .. } = *dynamics;
            clock
                .stage("time a substep", 0, |_| {
                    cost_report::of_substeps(&backend, system, settings, plan.costs)
                })
                .map_err(loaded.blame("solver"))?
        }
        Matter::Chain(chain) => clock.stage("time a frame", 0, |_| {
            let mut motion = Chained::new(loaded, *chain, &body, backend.chain_threads(), None)?;
            cost_report::of_first_frame(&mut motion, plan.costs)
        })?,
    };
    plan.stages = clock.stages;
    Ok(plan)
}

/// Reads the CT, builds body and system.
pub(crate) fn prepare(
    loaded: &LoadedScene,
    request: Request,
    clock: &mut Clock<'_>,
) -> Result<Prepared, Error> {
    let from_file = loaded.scene.volume.path.is_some();
    let name = if from_file { "read the CT" } else { "make the phantom" };
    let source = clock.stage(name, 0, |_| source::load(loaded))?;
    if loaded.scene.output.volume && source.volume.grid().affine.is_sheared() {
        return Err(Error::SceneKey {
            file: loaded.file.clone(),
            key: "output.volume".into(),
            value: "true".into(),
            why: "cannot be written: the axes of the CT are not at right angles; resample it to an orthogonal grid \
                  first, or leave this output out"
                .into(),
        });
    }
    let body = clock.stage("lattice, skin, incision", 0, |_| Body::build(loaded, &source.volume))?;
    let matter = match loaded.scene.model {
        Model::Pbd => {
            let dynamics = clock.stage("constraints and colors", 0, |_| dynamics::build(loaded, &body))?;
            Matter::Dynamics(Box::new(dynamics))
        }
        Model::Chainmail => {
            let chain = clock.stage("links and materials", 0, |_| ChainBody::build(loaded, &body))?;
            Matter::Chain(Box::new(chain))
        }
    };
    let mut warnings = source.warnings.clone();
    warnings.extend(body.warnings.iter().cloned());
    warnings.extend(region::idle(&body));
    let costs = match &matter {
        Matter::Dynamics(dynamics) => costs::of_dynamics(loaded, &body, dynamics, request)?,
        Matter::Chain(chain) => costs::of_chain(loaded, &body, chain, request),
    };
    let Costs { backend, sizes, colors, memory, device_memory, projections, left_out, warnings: more } =
        costs;
    warnings.extend(more);
    warnings.extend(narrow_incisions(loaded, &body));
    warnings.extend(backend.note.clone());
    if let (Some(adapter), false) = (&loaded.scene.solver.adapter, backend.on_gpu()) {
        warnings.push(format!(
            "solver.adapter = {adapter:?} has no effect: the run is on {}, which is no GPU",
            backend.report.name
        ));
    }
    let mut left_out: Vec<String> = left_out.into_iter().chain(idle_sections(loaded, &backend)).collect();
    region::left_out(&body, &memory, &mut left_out);
    let plan = Plan {
        backend: backend.report.clone(),
        sizes,
        colors,
        costs: CostReport::of_memory(&memory, &device_memory, NO_DEVICE),
        memory,
        device_memory,
        volume_bytes: 2 * source.volume.voxels().len(),
        projections,
        left_out,
        warnings,
        stages: Vec::new(),
    };
    Ok(Prepared { source, body, matter, backend, plan })
}

/// What the scene does not name, whatever the model. Each line says what is not done for that reason.
fn idle_sections(loaded: &LoadedScene, backend: &Chosen) -> Vec<String> {
    let scene = &loaded.scene;
    let output = &scene.output;
    let gpu = format!("gpu: {}", backend::ABSENT.unwrap_or("no device is opened"));
    let lines = [
        (!needs_skin(loaded), "skin: not detected, nothing refers to it"),
        (scene.incision.is_empty(), "incision: nothing is cut"),
        (scene.handle.is_empty(), "handle: nothing is dragged"),
        (scene.run.checkpoint_every == 0, "checkpoints: none are written"),
        (!output.volume && !output.pictures, "volume: the CT is not resampled"),
        (
            output.pictures && !output.volume,
            "volume: the CT is resampled for the pictures only and not written",
        ),
        (!output.surface, "surface: skin.vtu is not written"),
        (!output.tissue, "tissue: tissue.vtu is not written"),
        (!output.pictures, "pictures: nothing is rendered"),
        (!output.report, "report: report.json, report.html and frames.csv are not written"),
        (!backend.on_gpu(), &gpu),
    ];
    lines.into_iter().filter(|(absent, _)| *absent).map(|(_, line)| line.to_owned()).collect()
}

/// An incision that is narrower than a step opens wider than it says.
fn narrow_incisions(loaded: &LoadedScene, body: &Body) -> Vec<String> {
    let step = body.mesh.lattice.longest_step_mm();
    let all = loaded.scene.incision.iter().enumerate();
    let narrow = all.filter(|(_, incision)| incision.width_mm < 0.95 * step).map(|(n, incision)| {
        format!(
            "incision[{n}].width_mm = {} is less than the lattice step of {step:.2} mm: the lips begin about one to two \
             steps apart",
            incision.width_mm
        )
    });
    narrow.collect()
}
