//! What a model costs, and what of the scene has no part in it.

use std::collections::BTreeMap;

use cutis_solver::StepProfile;

use crate::Error;
use crate::backend::{Chosen, Request};
use crate::body::Body;
use crate::cost::estimate::Expense;
use crate::model::chainmail::chain::ChainBody;
use crate::model::constraints::system::Dynamics;
use crate::report::{MemoryPart, Sizes};
use crate::scene::LoadedScene;

/// What a plan says of the model.
pub(super) struct Costs {
    pub(super) backend: Chosen,
    pub(super) sizes: Sizes,
    pub(super) colors: BTreeMap<String, usize>,
    pub(super) memory: Vec<MemoryPart>,
    pub(super) device_memory: Vec<MemoryPart>,
    pub(super) projections: u64,
    pub(super) left_out: Vec<String>,
    pub(super) warnings: Vec<String>,
}

/// Of position-based dynamics.
pub(super) fn of_dynamics(
    loaded: &LoadedScene,
    body: &Body,
    dynamics: &Dynamics,
    request: Request,
) -> Result<Costs, Error> {
    let Dynamics { system, settings, .. } = dynamics;
    let expense =
        Expense::of(system, settings).map_err(|error| loaded.blame("solver")(Error::Solver(error)))?;
    let work = expense.work(system, settings, loaded.scene.run.frames);
    let backend = request.settle(loaded, &work)?;
    let colors = match expense.vertex_colors() {
        Some(number) => BTreeMap::from([(StepProfile::DESCENT.to_owned(), number)]),
        None => dynamics.colors.clone(),
    };
    let removed = removed(body);
    let still = system.vertices().iter().filter(|v| v.inverse_mass() == 0.0).count();
    let constraints = &loaded.scene.constraints;
    let absent = [
        (constraints.distance.is_none(), "distance: no edge constraints are stored or projected"),
        (constraints.volume.is_none(), "volume: no tetrahedron constraints are stored or projected"),
        (constraints.stc.is_none(), "stc: no skin triangle constraints are stored or projected"),
        (loaded.scene.solver.iterations == 1, "multipliers: one iteration per substep needs none stored"),
    ];
    let mut warnings = of_scene(loaded, body);
    warnings.extend(unfinished_handles(loaded));
    warnings.extend(dynamics.skin_rate.and_then(|rate| unresolved_skin(loaded, rate)));
    Ok(Costs {
        device_memory: backend.device_memory(system, settings),
        backend,
        sizes: sizes(body, removed, still - removed),
        colors,
        memory: expense.memory,
        projections: work.projections,
        left_out: named(&absent),
        warnings,
    })
}

/// Of ChainMail.
pub(super) fn of_chain(loaded: &LoadedScene, body: &Body, chain: &ChainBody, request: Request) -> Costs {
    let scene = &loaded.scene;
    let part = |(part, bytes): (&str, usize)| MemoryPart { part: part.into(), bytes };
    let visits = [chain.relax_per_frame, scene.run.frames]
        .iter()
        .fold(body.mesh.positions.len() as u64, |product, &n| product.saturating_mul(n.into()));
    let absent = [
        (
            true,
            "solver: no masses, no constraints and no substeps; of this section dt_s, backend and threads hold",
        ),
        (chain.relax_per_frame == 0, "relaxation: links stay where drags leave them"),
    ];
    let mut warnings = Vec::new();
    if scene.constraints != Default::default() {
        warnings.push("constraints have no effect with model = \"chainmail\"".to_owned());
    }
    if scene.solver.gravity_m_s2 != [0.0; 3] {
        warnings.push("solver.gravity_m_s2 has no effect with model = \"chainmail\"".to_owned());
    }
    if scene.handle.is_empty() {
        warnings
            .push("there is no handle: with model = \"chainmail\" nothing else moves the body".to_owned());
    }
    warnings.extend(unfinished_handles(loaded));
    let backend = request.settle_chain(loaded);
    Costs {
        device_memory: backend.chain_memory(&chain.chain),
        backend,
        sizes: Sizes { edges: chain.chain.links(), ..sizes(body, removed(body), chain.fixed) },
        colors: BTreeMap::new(),
        memory: chain.chain.bytes().map(part).into(),
        projections: visits,
        left_out: named(&absent),
        warnings,
    }
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

/// Handles that the last frame stops on their way.
fn unfinished_handles(loaded: &LoadedScene) -> impl Iterator<Item = String> {
    let all_s = f64::from(loaded.scene.run.frames) * loaded.scene.solver.dt_s;
    let handles = loaded.scene.handle.iter().enumerate();
    // Frames that add up to it but for rounding are enough.
    handles.filter(move |(_, handle)| handle.over_s > all_s * (1.0 + 1e-9)).map(move |(n, handle)| {
        let share = 100.0 * all_s / handle.over_s;
        format!(
            "handle[{n}] comes {share:.3} % of its way: its over_s is {} s, and the frames take {all_s} s",
            handle.over_s
        )
    })
}

/// What in the scene will not do what it looks like.
fn of_scene(loaded: &LoadedScene, body: &Body) -> Vec<String> {
    let scene = &loaded.scene;
    let none = scene.constraints == Default::default();
    let still = scene.fixed == Default::default();
    let gravity = scene.solver.gravity_m_s2 != [0.0; 3];
    let lines = [
        (scene.chainmail.is_some(), "chainmail has no effect with model = \"pbd\""),
        (none, "no constraint kind is named: nothing holds the tissue together"),
        (still && gravity, "gravity acts and nothing is fixed: the body will fall"),
        (
            still && scene.constraints.stc.is_some(),
            "skin tension acts and nothing is fixed: the whole body may shrink and drift",
        ),
        (
            scene.constraints.stc.is_some() && body.skin.is_empty(),
            "no skin was found: skin tension has nothing to act on",
        ),
    ];
    named(&lines)
}

fn removed(body: &Body) -> usize {
    body.cut.removed.iter().filter(|&&removed| removed).count()
}

fn sizes(body: &Body, removed: usize, fixed: usize) -> Sizes {
    let mesh = &body.mesh;
    Sizes {
        lattice: mesh.lattice.grid().shape,
        vertices: mesh.positions.len(),
        edges: mesh.edges.len(),
        tets: mesh.tets.len(),
        skin_triangles: body.skin.len(),
        removed_vertices: removed,
        fixed_vertices: fixed,
        frozen_vertices: mesh.inactive.as_ref().map_or(0, |frozen| frozen.vertices),
        frozen_tets: mesh.inactive.as_ref().map_or(0, |frozen| frozen.tets),
    }
}

fn named(lines: &[(bool, &str)]) -> Vec<String> {
    lines.iter().filter(|(absent, _)| *absent).map(|(_, line)| (*line).to_owned()).collect()
}
