//! The cost of a model, and the counts and warnings that models share.

use std::collections::BTreeMap;

use crate::backend::Chosen;
use crate::body::{Body, GrowingCuts};
use crate::model::constraints::coloring::Coloring;
use crate::output::report::{MemoryPart, Sizes};
use crate::scene::{HandleSection, Scene};

/// The model's part of a plan.
pub(crate) struct ModelCosts {
    pub(crate) backend: Chosen,
    pub(crate) sizes: Sizes,
    pub(crate) colors: BTreeMap<String, usize>,
    pub(crate) colorings: BTreeMap<String, Coloring>,
    /// Memory on the host by part, bytes.
    pub(crate) memory: Vec<MemoryPart>,
    /// Memory on the GPU by part, bytes; empty on a CPU backend.
    pub(crate) device_memory: Vec<MemoryPart>,
    /// Projections of the run, or the model's unit of work that corresponds to them.
    pub(crate) projections: u64,
    pub(crate) left_out: Vec<String>,
    pub(crate) warnings: Vec<String>,
}

/// Element counts of a body. `fixed` is the number of vertices that do not move, without the
/// removed vertices.
pub(super) fn sizes(body: &Body, fixed: usize) -> Sizes {
    let mesh = &body.mesh;
    let inactive = mesh.inactive.as_ref();
    Sizes {
        lattice: mesh.lattice.grid().shape,
        vertices: mesh.positions.len(),
        edges: mesh.edges.len(),
        tets: mesh.tets.len(),
        skin_triangles: body.skin.len(),
        lip_pairs: 0,
        removed_vertices: body.removed_vertices(),
        fixed_vertices: fixed,
        frozen_vertices: inactive.map_or(0, |inactive| inactive.vertices),
        frozen_tets: inactive.map_or(0, |inactive| inactive.tets),
    }
}

/// Warnings about handles that are still moving when the last frame ends.
pub(super) fn unfinished_handles(scene: &Scene) -> impl Iterator<Item = String> {
    let run_s = f64::from(scene.most_frames()) * scene.solver.dt_s;
    let handles = scene.handle.iter().enumerate();
    // The sum of the frames may fall short of the handle's time by rounding.
    let late = move |handle: &HandleSection| handle.at_s + handle.over_s > run_s * (1.0 + 1e-9);
    handles.filter(move |(_, handle)| late(handle)).map(move |(n, handle)| {
        let HandleSection { at_s, over_s, .. } = *handle;
        let share = 100.0 * (run_s - at_s).max(0.0) / over_s;
        let begins = if at_s > 0.0 { format!("it begins at {at_s} s, ") } else { String::new() };
        format!(
            "handle[{n}] comes {share:.3} % of its way: {begins}its over_s is {over_s} s, and the frames take \
             {run_s} s. Set run.frames to more"
        )
    })
}

/// Warnings about cuts that have not reached their end when the last frame begins.
pub(super) fn unfinished_cuts(scene: &Scene, cuts: &GrowingCuts) -> Vec<String> {
    let last_s = scene.last_frame_s();
    let incisions = scene.incision.iter().enumerate().filter(|(_, section)| section.width_mm.is_none());
    let incisions = incisions.map(|(n, _)| format!("incision[{n}]"));
    let underminings = (0..scene.undermining.len()).map(|n| format!("undermining[{n}]"));
    let excisions = (0..scene.excision.len()).map(|n| format!("excision[{n}]"));
    let names = incisions.chain(underminings).chain(excisions);
    let blades = names.zip(cuts.reached(last_s)).zip(cuts.growth.lengths());
    let unfinished = blades.filter(|((_, reached), length)| reached < length);
    let line = |((name, reached), length): ((String, f64), f64)| {
        let [reached, length] = [reached, length].map(|m| m * 1000.0);
        format!(
            "{name} comes {reached:.1} of {length:.1} mm far in the frames of this run. Set run.frames to more"
        )
    };
    unfinished.map(line).collect()
}

/// Warnings about sutures that have not been tightened when the last frame begins.
pub(super) fn unfinished_sutures(scene: &Scene) -> impl Iterator<Item = String> {
    let last_s = scene.last_frame_s();
    let sutures = scene.suture.iter().enumerate();
    sutures.filter(move |(_, suture)| suture.at_s + suture.tighten_s > last_s).map(move |(n, suture)| {
        let tight_s = suture.at_s + suture.tighten_s;
        format!("suture[{n}] is tight at {tight_s} s only, and the last frame begins at {last_s:.3} s. Set run.frames to more")
    })
}

/// The lines whose condition is true.
pub(crate) fn lines_that_hold(lines: &[(bool, &str)]) -> Vec<String> {
    lines.iter().filter(|(holds, _)| *holds).map(|(_, line)| (*line).to_owned()).collect()
}
