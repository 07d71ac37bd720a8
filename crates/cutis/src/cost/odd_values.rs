//! Notes on values that are valid and do not have the effect that a user expects.

use crate::body::Body;
use crate::scene::{RunEnd, Scene};

/// Damping times the duration of a frame above which a frame begins without speed.
const MOST_DAMPING: f64 = 10.0;
/// Depth of a cut, in lattice steps, below which it hardly opens.
const LEAST_DEPTH: f64 = 0.1;

/// Notes on a run of no frames, on damping that stops all motion, and on cuts of no depth.
pub(super) fn notes(scene: &Scene, body: &Body) -> Vec<String> {
    let mut notes = Vec::new();
    if scene.run.frames == 0 && scene.run.until == RunEnd::Frames {
        let text = "run.frames = 0: nothing moves. Set it to 60, or use `cutis settle` for the state of rest";
        notes.push(text.to_owned());
    }
    let damping = scene.solver.damping_per_s;
    if damping * scene.solver.dt_s > MOST_DAMPING {
        notes.push(format!(
            "solver.damping_per_s = {damping} takes all speed from the body within a frame of {:.3} s, so that a \
             wound hardly opens. 10 is usual",
            scene.solver.dt_s
        ));
    }
    let step = body.mesh.lattice.longest_step_mm();
    let incisions = scene.incision.iter().map(|cut| cut.depth_mm).enumerate();
    let excisions = scene.excision.iter().map(|cut| cut.depth_mm).enumerate();
    let cuts = incisions.map(|cut| ("incision", cut)).chain(excisions.map(|cut| ("excision", cut)));
    notes.extend(cuts.filter(|(_, (_, depth))| *depth < LEAST_DEPTH * step).map(|(list, (n, depth))| {
        format!(
            "{list}[{n}].depth_mm = {depth} is less than a tenth of the lattice step of {step:.2} mm, so that the cut \
             hardly opens. Make it deeper, or the lattice finer"
        )
    }));
    notes
}
