//! The system of a scene without a run around it, for programs that step, measure or solve it
//! themselves.

use cutis_mesh::{Frame, Gape};
use cutis_solver::{Settings, System};

use super::constraints::ConstraintModel;
use super::{ModelChoice, ModelInput};
use crate::Error;
use crate::body::{Body, BodySections};
use crate::ct::source;
use crate::scene::LoadedScene;

/// The system that a run of a scene steps, before the first frame.
pub struct SceneSystem {
    /// The body at rest: positions in local meters, constraints, handles.
    pub system: System<f32>,
    /// The scene's section `solver`.
    pub settings: Settings,
    /// One per incision of the scene, in the same order; they measure [`System::positions`].
    pub gapes: Vec<Gape>,
    /// Converts positions between local meters and RAS+ mm.
    pub frame: Frame,
}

/// Builds the system of a scene: reads the CT, makes the lattice and the cuts, and adds the
/// constraints and handles that the scene names. Opens no device, makes no step and writes nothing.
/// Cuts that a run makes while the body moves exist from the start, handles hold their tissue from
/// the start, and sutures do not pull.
///
/// ```no_run
/// use cutis::Scene;
/// use cutis::solver::Solver;
/// use cutis::solver_cpu::SolverCpu;
///
/// let built = cutis::build_system(&Scene::load("scene.toml".as_ref(), &[])?)?;
/// let mut solver = SolverCpu::new(built.system, built.settings, None)?;
/// solver.step(40)?;
/// println!("{:?}", built.gapes[0].measure(&solver.positions()?));
/// # Ok::<(), cutis::Error>(())
/// ```
///
/// # Errors
/// The errors that a run of the scene returns before its first frame; [`Error::SceneKey`] for a
/// model without a system.
pub fn build_system(loaded: &LoadedScene) -> Result<SceneSystem, Error> {
    needs_system(loaded)?;
    let source = source::load(loaded)?;
    // The system is that of the finished cuts.
    let sections = BodySections { cuts_grow: false, ..BodySections::of(loaded) };
    let body = Body::build(&sections, &source.volume)?;
    let input = ModelInput { file: loaded.file(), scene: &loaded.scene, body: &body };
    let ConstraintModel { system, settings, .. } = ConstraintModel::build(&input)?.unchanging()?;
    Ok(SceneSystem { system, settings, gapes: body.cut.gapes, frame: body.mesh.frame })
}

/// Refuses a model that has no system of constraints.
pub(crate) fn needs_system(loaded: &LoadedScene) -> Result<(), Error> {
    if loaded.scene.model == ModelChoice::Pbd {
        return Ok(());
    }
    let name = toml::Value::try_from(loaded.scene.model).map(|name| name.to_string()).unwrap_or_default();
    let why = "has no constraints, substeps or iterations; this is for model = \"pbd\"";
    Err(loaded.file().bad_key("model", &name, why))
}
