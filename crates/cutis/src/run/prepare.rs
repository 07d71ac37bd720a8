//! The first half of a run: from the NIfTI file to a body and its model.

use super::clock::Clock;
use crate::Error;
use crate::backend::{Chosen, Request};
use crate::body::{Body, BodySections};
use crate::cost::Plan;
use crate::ct::source::{self, Source};
use crate::model::{self, Model, ModelInput};
use crate::scene::LoadedScene;

/// Everything that a run needs before its first frame.
pub(crate) struct Prepared {
    pub(crate) source: Source,
    pub(crate) body: Body,
    pub(crate) model: Box<dyn Model>,
    pub(crate) backend: Chosen,
    pub(crate) plan: Plan,
}

/// Reads the CT, builds body and model, and plans the run.
///
/// # Errors
/// [`Error`] for a scene that does not work with this CT or on this machine.
pub(crate) fn prepare(
    loaded: &LoadedScene,
    request: Request,
    clock: &mut Clock<'_>,
) -> Result<Prepared, Error> {
    let scene = &loaded.scene;
    let from_file = scene.volume.path.is_some();
    let name = if from_file { "read the CT" } else { "make the phantom" };
    let source = clock.stage(name, 0, |_| source::load(loaded))?;
    refuse_sheared(loaded, &source)?;
    let body = clock
        .stage("lattice, skin, incision", 0, |_| Body::build(&BodySections::of(loaded), &source.volume))?;
    let input = ModelInput { file: loaded.file(), scene, body: &body };
    let model = model::build(&input, clock)?;
    let costs = model.costs(&input, request)?;
    let (mut plan, backend) = Plan::new(scene, &source, &body, costs);
    plan.warnings.extend_from_slice(&loaded.notes);
    Ok(Prepared { source, body, model, backend, plan })
}

/// Refuses to write a volume whose axes are not at right angles, which readers do not expect.
fn refuse_sheared(loaded: &LoadedScene, source: &Source) -> Result<(), Error> {
    let output = &loaded.scene.output;
    let on_grid = [
        (output.volume, "output.volume"),
        (output.displacement, "output.displacement"),
        (output.displacement_forward, "output.displacement_forward"),
    ];
    let named = on_grid.iter().find(|(named, _)| *named);
    let Some((_, key)) = named.filter(|_| source.volume.grid().affine.is_sheared()) else { return Ok(()) };
    let why = "cannot be written: the axes of the CT are not at right angles; volume.resample = true \
               resamples it to perpendicular axes; or leave this output out";
    Err(loaded.file().bad_key(key, "true", why))
}
