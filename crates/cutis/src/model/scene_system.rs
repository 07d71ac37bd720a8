//! The system of a scene, without a run around it: for whoever steps it, measures it or solves it otherwise.

use cutis_mesh::Gape;
use cutis_solver::{Settings, System};

use crate::Error;
use crate::body::Body;
use crate::ct::source;
use crate::model::constraints::system as dynamics;
use crate::scene::{LoadedScene, Model};

/// What a run of a scene steps, before its first frame.
pub struct SceneSystem {
    /// The body at rest: positions in local meters, constraints, handles.
    pub system: System<f32>,
    /// The scene's section `solver`.
    pub settings: Settings,
    /// One for each incision of the scene, in order; they measure [`System::positions`].
    pub gapes: Vec<Gape>,
}

/// Builds the system of a scene: reads the CT, makes the lattice and the cuts, and what the scene names of constraints and
/// handles. No device is opened, no step is made and nothing is written.
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
/// [`Error`] as a run of the scene would give it before its first frame; [`Error::SceneKey`] for a model without a system.
pub fn build_system(loaded: &LoadedScene) -> Result<SceneSystem, Error> {
    needs_system(loaded)?;
    let source = source::load(loaded)?;
    let body = Body::build(loaded, &source.volume)?;
    let dynamics = dynamics::build(loaded, &body)?;
    Ok(SceneSystem { system: dynamics.system, settings: dynamics.settings, gapes: body.cut.gapes })
}

/// Refuses a model that has no system of constraints.
pub(crate) fn needs_system(loaded: &LoadedScene) -> Result<(), Error> {
    if loaded.scene.model == Model::Pbd {
        return Ok(());
    }
    Err(Error::SceneKey {
        file: loaded.file.clone(),
        key: "model".into(),
        value: "\"chainmail\"".into(),
        why: "has no constraints, substeps or iterations; this is for model = \"pbd\"".into(),
    })
}
