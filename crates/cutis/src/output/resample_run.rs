//! `cutis resample`: resamples another volume through the deformation of a finished run.

use std::path::PathBuf;

use cutis_volume::{Format, ReadOptions};

use super::last_cut_s;
use super::report::Resample;
use super::warp::BodyWarp;
use crate::backend::{Request, Stages};
use crate::body::{Body, BodySections};
use crate::ct::source;
use crate::run::checkpoint::{self, Checkpoint};
use crate::run::clock::Clock;
use crate::run::files::RunFolder;
use crate::scene::LoadedScene;
use crate::{Error, Progress};

/// The volume that `cutis resample` deforms, and the run that deforms it.
#[derive(Clone, Debug)]
pub struct ResampleRequest {
    /// Run folder with a checkpoint.
    pub run: PathBuf,
    /// Volume to deform; the scene's own volume if there is none.
    pub volume: Option<PathBuf>,
    /// File to write.
    pub out: PathBuf,
}

/// Deforms a volume in the same way as a finished run deformed its own volume.
///
/// # Errors
/// [`Error::Checkpoint`] if the run's checkpoint belongs to another scene; other [`Error`]s as for
/// a run.
pub fn resample_run(
    loaded: &LoadedScene,
    request: &ResampleRequest,
    progress: &dyn Progress,
) -> Result<Resample, Error> {
    // A wrong name is reported before the time for resampling is spent.
    Format::of(&request.out)?;
    let mut clock = Clock::new(progress);
    let folder = RunFolder(request.run.clone());
    let mut stages = Stages::on(Request::of(loaded)?.open()?);
    let source = clock.stage("read the CT", 0, |_| source::load(loaded))?;
    let body = clock
        .stage("lattice, skin, incision", 0, |_| Body::build(&BodySections::of(loaded), &source.volume))?;
    let fingerprint = checkpoint::fingerprint(&loaded.scene, &source.sha256);
    let saved = Checkpoint::read(&folder.checkpoint(), &fingerprint, body.mesh.positions.len())?;
    let volume = match &request.volume {
        Some(path) => cutis_volume::read(path, &ReadOptions::default())?.volume,
        None => source.volume,
    };
    let warp = BodyWarp::new(&body, &saved.positions, last_cut_s(&loaded.scene, saved.frame), None, &stages)?;
    let (deformed, report) =
        clock.stage("resample", 0, |progress| warp.apply(&volume, &mut stages, progress))?;
    stages.notes.iter().for_each(|note| progress.note(note));
    clock.stage("write", 0, |_| Ok(cutis_volume::write(&request.out, &deformed)?))?;
    Ok(report)
}
