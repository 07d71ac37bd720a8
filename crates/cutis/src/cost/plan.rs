//! The plan of a scene, known before it runs: sizes, colors, memory, what is left out, the backend.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{CostReport, left_out, odd_values};
use crate::backend::{Chosen, Request};
use crate::body::{Body, Membrane, near_end};
use crate::ct::source::Source;
use crate::model::constraints::coloring::Coloring;
use crate::model::constraints::kinds::{ConstraintKind, KindRow, ScanTension};
use crate::model::{ModelChoice, ModelCosts, ModelInput};
use crate::output::report::{Backend, MaterialRow, MembraneReport, MemoryPart, Sizes, Stage};
use crate::output::step_report::StepReport;
use crate::run::clock::Clock;
use crate::run::prepare::{Prepared, prepare};
use crate::scene::{IncisionSection, LoadedScene, Scene};
use crate::{Error, Progress};

/// Why a plan has no times.
const NO_DEVICE: &str = "not measured: no device is opened for a plan; `cutis tune` measures on the GPU";

/// The plan of a scene, as `cutis check` prints it.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Plan {
    /// Backend that will run the solver.
    pub backend: Backend,
    /// Element counts.
    pub sizes: Sizes,
    /// Tension of the skin in the scan, by constraint kind.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub tension: BTreeMap<String, ScanTension>,
    /// Normals and lines of tension of `constraints.membrane`, if the scene has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub membrane: Option<MembraneReport>,
    /// The scene's table of materials, if its model uses one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub materials: Vec<MaterialRow>,
    /// What is done to the body, in the order of time.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub steps: Vec<StepReport>,
    /// Colors per constraint kind; in vertex block descent only the colors of the vertices, as
    /// `descent`.
    pub colors: BTreeMap<String, usize>,
    /// How the colors were found, with the same keys.
    #[serde(default)]
    pub colorings: BTreeMap<String, Coloring>,
    /// Memory of the solver on the host by part, bytes.
    pub memory: Vec<MemoryPart>,
    /// Memory of the solver on the GPU by part, bytes; empty on a CPU backend. Kernels are compiled
    /// for these parts and for no others.
    pub device_memory: Vec<MemoryPart>,
    /// Bytes and time of the solver by part.
    #[serde(rename = "ledger")]
    pub costs: CostReport,
    /// Bytes of the volume's voxels.
    pub volume_bytes: usize,
    /// Number of projections in the run. In vertex block descent the number of vertex steps; with
    /// ChainMail the largest possible number of element visits by relaxation. Saturates at the
    /// largest 64-bit number.
    pub projections: u64,
    /// Parts that the scene leaves out, which therefore cost nothing.
    pub left_out: Vec<String>,
    /// Warnings to the user.
    pub warnings: Vec<String>,
    /// Time that planning took, by stage.
    pub stages: Vec<Stage>,
}

/// Plans a scene: reads the CT and builds body and model, but opens no device and writes nothing.
/// On a CPU backend it steps the body for a moment to measure the time of a frame.
///
/// # Errors
/// The errors that a run of the scene returns before its first frame.
pub fn check(loaded: &LoadedScene, progress: &dyn Progress) -> Result<Plan, Error> {
    let mut clock = Clock::new(progress);
    let Prepared { body, model, backend, mut plan, .. } = prepare(loaded, Request::of(loaded)?, &mut clock)?;
    if !backend.on_gpu() {
        let input = ModelInput { file: loaded.file(), scene: &loaded.scene, body: &body };
        plan.costs = model.measure(&input, &backend, plan.costs, &mut clock)?;
    }
    plan.stages = clock.stages;
    Ok(plan)
}

impl Plan {
    /// The plan of a model with these costs, and the backend that was chosen.
    pub(crate) fn new(scene: &Scene, source: &Source, body: &Body, costs: ModelCosts) -> (Self, Chosen) {
        let ModelCosts { backend, sizes, colors, colorings, memory, device_memory, projections, .. } = costs;
        let mut warnings = [source.warnings.as_slice(), &body.warnings].concat();
        warnings.extend(costs.warnings);
        warnings.extend(near_end::notes(scene, &source.volume));
        warnings.extend(odd_values::notes(scene, body));
        warnings.extend(narrow_incisions(&scene.incision, body));
        warnings.extend(backend.note.clone());
        warnings.extend(idle_adapter(scene, &backend));
        let mut left_out = costs.left_out;
        left_out.extend(left_out::sections(scene, &backend));
        left_out.extend(left_out::of_lattice(body, &memory));
        let plan = Self {
            backend: backend.report.clone(),
            sizes,
            tension: tensions(scene),
            membrane: body.membrane.as_ref().map(Membrane::report),
            materials: body.materials.as_ref().map(|of_body| of_body.report(&body.mesh)).unwrap_or_default(),
            steps: StepReport::all(scene, body),
            colors,
            colorings,
            costs: CostReport::of_memory(&memory, &device_memory, NO_DEVICE),
            memory,
            device_memory,
            volume_bytes: 2 * source.volume.voxels().len(),
            projections,
            left_out,
            warnings,
            stages: Vec::new(),
        };
        (plan, backend)
    }
}

/// The tension of the skin that the scene stands for, by constraint kind.
fn tensions(scene: &Scene) -> BTreeMap<String, ScanTension> {
    let of_kind =
        |(row, kind): (&KindRow, &dyn ConstraintKind)| Some((row.key.to_owned(), kind.tension(scene)?));
    let pbd = scene.model == ModelChoice::Pbd;
    scene.constraints.named().filter(|_| pbd).filter_map(of_kind).collect()
}

/// Warning about an adapter that the scene names although it does not run on a GPU.
fn idle_adapter(scene: &Scene, backend: &Chosen) -> Option<String> {
    let adapter = scene.solver.adapter.as_ref().filter(|_| !backend.on_gpu())?;
    Some(format!(
        "solver.adapter = {adapter:?} has no effect: the run is on {}, which is no GPU",
        backend.report.name
    ))
}

/// Warnings about incisions narrower than a lattice step, whose lips are farther apart at the start
/// than the scene says.
fn narrow_incisions(incisions: &[IncisionSection], body: &Body) -> Vec<String> {
    let step = body.mesh.lattice.longest_step_mm();
    let all = incisions.iter().enumerate();
    let width = |(n, incision): (usize, &IncisionSection)| Some((n, incision.width_mm?));
    let narrow = all.filter_map(width).filter(|(_, width)| *width < 0.95 * step).map(|(n, width)| {
        format!(
            "incision[{n}].width_mm = {width} is less than the lattice step of {step:.2} mm: the lips begin \
             about one to two steps apart. Leave width_mm out, so that they begin closed, or set \
             lattice.spacing_mm to {width} or less"
        )
    });
    narrow.collect()
}
