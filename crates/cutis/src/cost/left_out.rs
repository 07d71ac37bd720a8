//! The parts that a scene leaves out and does not pay for, for every model.

use crate::backend::{self, Chosen};
use crate::body::{Body, even_shape, needs_skin, smooth_skin};
use crate::model::constraints::kinds::KINDS;
use crate::output::report::MemoryPart;
use crate::scene::{PickedRegion, Scene};

/// Sections that the scene does not name, each with the work that is skipped for that reason.
pub(super) fn sections(scene: &Scene, backend: &Chosen) -> Vec<String> {
    let output = &scene.output;
    let gpu = format!("gpu: {}", backend::ABSENT.unwrap_or("no device is opened"));
    let lines = [
        (!needs_skin(scene), "skin: not detected, nothing refers to it"),
        (
            needs_skin(scene) && !smooth_skin(scene),
            "skin.smooth: the vertices of the skin stay on the planes of the lattice",
        ),
        (!scene.cuts(), "incision: nothing is cut"),
        (scene.suture.is_empty(), "suture: nothing is closed"),
        (scene.handle.is_empty(), "handle: nothing is dragged"),
        (scene.run.checkpoint_every == 0, "checkpoints: none are written"),
        (!output.volume && !output.pictures, "volume: the CT is not resampled"),
        (
            output.pictures && !output.volume,
            "volume: the CT is resampled for the pictures only and not written",
        ),
        (!output.surface, "surface: skin.vtu is not written"),
        (output.series_every == 0, "series: the skin is not written after frames"),
        (!(output.ply || output.stl), "ply, stl: no surface without data is written"),
        (!output.tissue, "tissue: tissue.vtu is not written"),
        (
            !(output.displacement || output.displacement_forward),
            "displacement: no displacement field is computed",
        ),
        (!output.pictures, "pictures: nothing is rendered"),
        (!output.report, "report: report.json, report.html and frames.csv are not written"),
        (!backend.on_gpu(), &gpu),
    ];
    lines.into_iter().filter(|(absent, _)| *absent).map(|(_, line)| line.to_owned()).collect()
}

/// The parts that a region of interest and a graded lattice leave out. `memory` is the memory of
/// the solver by part.
pub(super) fn of_lattice(body: &Body, memory: &[MemoryPart]) -> Vec<String> {
    [region(body, memory), grading(body)].into_iter().flatten().collect()
}

fn region(body: &Body, memory: &[MemoryPart]) -> Option<String> {
    let mesh = &body.mesh;
    let inactive = mesh.inactive.as_ref().filter(|inactive| inactive.tets > 0)?;
    let kept_and_left = |part: &str| match KINDS.iter().find(|row| row.key == part) {
        Some(row) => (row.facts.counts)(body),
        None if ["vertices", "columns"].contains(&part) => [mesh.positions.len(), inactive.vertices],
        None => [0, 0],
    };
    let saved = |part: &MemoryPart| {
        let [kept, left] = kept_and_left(&part.part);
        part.bytes as f64 * left as f64 / kept.max(1) as f64
    };
    let bytes: f64 = memory.iter().map(saved).sum();
    let why = body.picked_region.map_or(String::new(), |PickedRegion { wound_mm, error }| {
        format!(
            "; it was picked for wounds of {wound_mm:.0} mm, whose opening is about {:.0} % smaller than in \
             the whole body (lattice.region = \"whole\")",
            100.0 * error
        )
    });
    Some(format!(
        "region: {} of {} tetrahedra and {} of {} vertices lie outside it; they are neither stored nor \
         simulated, which saves about {:.1} MB of the solver's memory{why}",
        inactive.tets,
        inactive.tets + mesh.tets.len(),
        inactive.vertices,
        inactive.vertices + mesh.positions.len(),
        bytes / 1e6
    ))
}

fn grading(body: &Body) -> Option<String> {
    let lattice = &body.mesh.lattice;
    lattice.planes()?;
    let product = |shape: [usize; 3]| shape.iter().product::<usize>();
    Some(format!(
        "grading: the lattice has {} points instead of {} at the spacing of its fine zone",
        product(lattice.grid().shape),
        product(even_shape(lattice))
    ))
}
