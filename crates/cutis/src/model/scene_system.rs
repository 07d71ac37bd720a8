//! The system of a scene without a run around it, for programs that step, measure or solve it
//! themselves.

use cutis_mesh::{Frame, Gape};
use cutis_resample::{ResampleReport, Resampler};
use cutis_solver::{Settings, System};
use cutis_volume::Volume;
use nalgebra::Point3;

use super::constraints::ConstraintModel;
use super::{ModelChoice, ModelInput};
use crate::Error;
use crate::body::{Body, BodySections};
use crate::ct::source;
use crate::output::warp_mesh::WarpMesh;
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
    Ok(build(loaded)?.0)
}

/// Does the same as [`build_system`], and also returns the CT, to deform it with the body.
///
/// # Errors
/// The errors of [`build_system`].
pub fn build_system_and_ct(loaded: &LoadedScene) -> Result<(SceneSystem, SceneCt), Error> {
    let (system, body, volume) = build(loaded)?;
    Ok((system, SceneCt { mesh: WarpMesh::new(&body, f64::INFINITY)?, volume }))
}

/// The CT of a scene, and the mesh through which it is deformed.
pub struct SceneCt {
    /// The CT.
    pub volume: Volume,
    mesh: WarpMesh,
}

impl SceneCt {
    /// A resampler of the CT, for many states of the body.
    ///
    /// # Errors
    /// The errors of [`Resampler::new`].
    pub fn resampler(&self) -> Result<Resampler<'_>, Error> {
        Ok(Resampler::new(&self.volume, &self.mesh.warp(&self.mesh.rest))?)
    }

    /// The positions that the resampler needs, from those of the system: the shell of air around
    /// the body follows it.
    ///
    /// # Panics
    /// If there are fewer positions than the system has.
    pub fn follow(&self, positions: &[Point3<f32>]) -> Vec<Point3<f32>> {
        [positions, &self.mesh.further(positions)].concat()
    }

    /// Resamples the whole CT once through positions that [`SceneCt::follow`] returned.
    ///
    /// # Errors
    /// The errors of [`cutis_resample::resample`].
    pub fn resample(&self, deformed: &[Point3<f32>]) -> Result<(Volume, ResampleReport), Error> {
        Ok(cutis_resample::resample(&self.volume, &self.mesh.warp(deformed), &|_done, _total| {})?)
    }
}

fn build(loaded: &LoadedScene) -> Result<(SceneSystem, Body, Volume), Error> {
    needs_system(loaded)?;
    let source = source::load(loaded)?;
    // The system is that of the finished cuts.
    let sections = BodySections { cuts_grow: false, ..BodySections::of(loaded) };
    let body = Body::build(&sections, &source.volume)?;
    let input = ModelInput { file: loaded.file(), scene: &loaded.scene, body: &body };
    let ConstraintModel { system, settings, .. } = ConstraintModel::build(&input)?.unchanging()?;
    let (gapes, frame) = (body.cut.gapes.clone(), body.mesh.frame);
    Ok((SceneSystem { system, settings, gapes, frame }, body, source.volume))
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
