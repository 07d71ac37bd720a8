//! What a scene will do, before it does it: sizes, colours, memory, what is left out, and which backend.

use cutis_solver::Ledger;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

use crate::backend::{self, Chosen, Request};
use crate::body::{Body, needs_skin};
use crate::clock::Clock;
use crate::dynamics::{self, Dynamics};
use crate::expense::Expense;
use crate::report::{Backend, MemoryPart, Sizes, Stage};
use crate::scene::LoadedScene;
use crate::source::{self, Source};
use crate::{CostLedger, Error, Progress, ledger, region};

/// Why a plan has no times.
const NO_DEVICE: &str = "not measured: no device is opened for a plan; `cutis tune` measures on the GPU";

/// The plan of a scene, as `cutis check` prints it.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Plan {
    /// Where the solver will run.
    pub backend: Backend,
    /// Element counts.
    pub sizes: Sizes,
    /// Colours per constraint kind; in vertex block descent those of the vertices, as `descent`, and no others.
    pub colors: BTreeMap<String, usize>,
    /// Memory of the solver on the host by part, bytes.
    pub memory: Vec<MemoryPart>,
    /// Memory of the solver on the GPU by part, bytes; empty on a CPU backend. Each part has kernels of its own, and what has
    /// no part here has none.
    pub device_memory: Vec<MemoryPart>,
    /// Bytes and time of the solver by part.
    pub ledger: CostLedger,
    /// Bytes of the volume's voxels.
    pub volume_bytes: usize,
    /// Projections of the run, or steps of a vertex in vertex block descent; the largest 64-bit number where it is more.
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
    pub(crate) dynamics: Dynamics,
    pub(crate) backend: Chosen,
    pub(crate) plan: Plan,
}

/// Plans a scene: reads the CT, builds the body and the system, opens no device and writes nothing. On a CPU backend it steps
/// the body for a moment, to tell what a frame would take.
///
/// # Errors
/// [`Error`] as a run of the scene would give it before its first frame.
pub fn check(loaded: &LoadedScene, progress: &dyn Progress) -> Result<Plan, Error> {
    let mut clock = Clock::new(progress);
    let Prepared { dynamics, backend, mut plan, .. } = prepare(loaded, Request::of(loaded)?, &mut clock)?;
    if !backend.on_gpu() {
        let Dynamics { system, settings, .. } = dynamics;
        plan.ledger = clock
            .stage("time a substep", 0, |_| ledger::of_substeps(&backend, system, settings, plan.ledger))
            .map_err(loaded.blame("solver"))?;
    }
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
    let dynamics = clock.stage("constraints and colours", 0, |_| dynamics::build(loaded, &body))?;
    let mut warnings = source.warnings.clone();
    warnings.extend(body.warnings.iter().cloned());
    warnings.extend(scene_warnings(loaded, &body));
    warnings.extend(region::idle(&body));
    warnings.extend(dynamics.skin_rate.and_then(|rate| unresolved_skin(loaded, rate)));
    let sizes = sizes(&body, &dynamics);
    let expense = Expense::of(&dynamics.system, &dynamics.settings)
        .map_err(|error| loaded.blame("solver")(Error::Solver(error)))?;
    let work = expense.work(&dynamics.system, &dynamics.settings, loaded.scene.run.frames);
    let backend = request.settle(loaded, &work)?;
    warnings.extend(backend.note.clone());
    if let (Some(adapter), false) = (&loaded.scene.solver.adapter, backend.on_gpu()) {
        warnings.push(format!(
            "solver.adapter = {adapter:?} has no effect: the run is on {}, which is no GPU",
            backend.report.name
        ));
    }
    let colors = match expense.vertex_colors() {
        Some(number) => BTreeMap::from([(Ledger::DESCENT.to_owned(), number)]),
        None => dynamics.colors.clone(),
    };
    let Expense { memory, .. } = expense;
    let device_memory = backend.device_memory(&dynamics.system, &dynamics.settings);
    let mut left_out = left_out(loaded, &backend);
    region::left_out(&body, &memory, &mut left_out);
    let plan = Plan {
        backend: backend.report.clone(),
        sizes,
        colors,
        ledger: CostLedger::of_memory(&memory, &device_memory, NO_DEVICE),
        memory,
        device_memory,
        volume_bytes: 2 * source.volume.voxels().len(),
        projections: work.projections,
        left_out,
        warnings,
        stages: Vec::new(),
    };
    Ok(Prepared { source, body, dynamics, backend, plan })
}

fn sizes(body: &Body, dynamics: &Dynamics) -> Sizes {
    let removed = body.cut.removed.iter().filter(|&&removed| removed).count();
    let still = dynamics.system.vertices().iter().filter(|v| v.inverse_mass() == 0.0).count();
    Sizes {
        lattice: body.mesh.lattice.grid().shape,
        vertices: body.mesh.positions.len(),
        edges: body.mesh.edges.len(),
        tets: body.mesh.tets.len(),
        skin_triangles: body.skin.len(),
        removed_vertices: removed,
        fixed_vertices: still - removed,
        frozen_vertices: body.mesh.frozen.as_ref().map_or(0, |frozen| frozen.vertices),
        frozen_tets: body.mesh.frozen.as_ref().map_or(0, |frozen| frozen.tets),
    }
}

/// What the scene does not name. Each line says what is not built for that reason.
fn left_out(loaded: &LoadedScene, backend: &Chosen) -> Vec<String> {
    let scene = &loaded.scene;
    let (constraints, output) = (&scene.constraints, &scene.output);
    let mut lines = Vec::new();
    let mut say = |absent: bool, line: &str| {
        if absent {
            lines.push(line.to_owned());
        }
    };
    say(constraints.distance.is_none(), "distance: no edge constraints are stored or projected");
    say(constraints.volume.is_none(), "volume: no tetrahedron constraints are stored or projected");
    say(constraints.stc.is_none(), "stc: no skin triangle constraints are stored or projected");
    say(!needs_skin(loaded), "skin: not detected, nothing refers to it");
    say(scene.incision.is_empty(), "incision: nothing is cut");
    say(scene.handle.is_empty(), "handle: nothing is dragged");
    say(scene.solver.iterations == 1, "multipliers: one iteration per substep needs none stored");
    say(scene.run.checkpoint_every == 0, "checkpoints: none are written");
    say(!output.volume && !output.pictures, "volume: the CT is not resampled");
    say(
        output.pictures && !output.volume,
        "volume: the CT is resampled for the pictures only and not written",
    );
    say(!output.surface, "surface: skin.vtu is not written");
    say(!output.tissue, "tissue: tissue.vtu is not written");
    say(!output.pictures, "pictures: nothing is rendered");
    say(!output.report, "report: report.json, report.html and frames.csv are not written");
    let gpu = backend::ABSENT.unwrap_or("no device is opened");
    say(!backend.on_gpu(), &format!("gpu: {gpu}"));
    lines
}

/// Says so if skin tension is stiffer than the substeps can follow. One projection per substep moves a vertex as far as
/// its inertia lets it within `h`; beyond `h·rate` of about one half the wound opens less than the modulus asks for, and
/// the more so the finer the lattice. With 2 projections per 1/rate the openings of the demo were within 5 % of those with
/// many more.
fn unresolved_skin(loaded: &LoadedScene, rate: f64) -> Option<String> {
    let solver = &loaded.scene.solver;
    let projections = f64::from(solver.substeps) * f64::from(solver.iterations);
    let needed = (2.0 * solver.dt_s * rate / f64::from(solver.iterations)).ceil();
    (projections < 1.5 * solver.dt_s * rate).then(|| {
        format!(
            "skin tension is stiffer than {} substeps can follow on this lattice: the wound will open less than the \
             modulus asks for; about {needed} substeps would do (or a coarser lattice, or a lower area modulus)",
            solver.substeps
        )
    })
}

fn scene_warnings(loaded: &LoadedScene, body: &Body) -> Vec<String> {
    let scene = &loaded.scene;
    let none = scene.constraints == Default::default();
    let still = scene.fixed == Default::default();
    let gravity = scene.solver.gravity_m_s2 != [0.0; 3];
    let lines = [
        (none, "no constraint kind is named: nothing holds the tissue together".to_owned()),
        (still && gravity, "gravity acts and nothing is fixed: the body will fall".to_owned()),
        (
            still && scene.constraints.stc.is_some(),
            "skin tension acts and nothing is fixed: the whole body may shrink and drift".to_owned(),
        ),
        (
            scene.constraints.stc.is_some() && body.skin.is_empty(),
            "no skin was found: skin tension has nothing to act on".to_owned(),
        ),
    ];
    let step = body.mesh.lattice.longest_step_mm();
    let narrow = scene.incision.iter().enumerate().filter(|(_, incision)| incision.width_mm < 0.95 * step);
    let narrow = narrow.map(|(n, incision)| {
        format!(
            "incision[{n}].width_mm = {} is less than the lattice step of {step:.2} mm: the lips begin about one to two \
             steps apart",
            incision.width_mm
        )
    });
    lines.into_iter().filter(|(holds, _)| *holds).map(|(_, line)| line).chain(narrow).collect()
}
