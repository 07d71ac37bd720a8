//! `cutis resample`: another volume, a label map or the displacement field of a finished run.

use std::path::{Path, PathBuf};

use cutis_resample::resample_labels;
use cutis_volume::{Format, LabelMap, ReadOptions, Volume};

use super::displacement::{FieldDirection, write_field};
use super::report::Resample;
use super::warp::BodyWarp;
use crate::backend::{Request, Stages};
use crate::body::{Body, BodySections};
use crate::ct::source;
use crate::run::checkpoint::{self, Checkpoint};
use crate::run::clock::Clock;
use crate::run::files::RunFolder;
use crate::run::other_scene;
use crate::scene::LoadedScene;
use crate::{Error, Progress};

/// What `cutis resample` writes, and the run that deforms it.
#[derive(Clone, Debug)]
pub struct ResampleRequest {
    /// Run folder with a checkpoint.
    pub run: PathBuf,
    /// What to deform.
    pub input: ResampleInput,
    /// File to write.
    pub out: PathBuf,
}

/// What a finished run deforms.
#[derive(Clone, Debug)]
pub enum ResampleInput {
    /// A volume in HU; the scene's own volume if there is none.
    Volume(Option<PathBuf>),
    /// A label map on its own grid, in the same world frame. Its values are never mixed.
    Labels(PathBuf),
    /// The displacement field on the grid of the scene's volume.
    Field(FieldDirection),
}

/// Deforms a volume or a label map in the same way as a finished run deformed its own volume, or
/// writes the displacement field.
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
    check_name(request)?;
    let mut clock = Clock::new(progress);
    let folder = RunFolder(request.run.clone());
    let mut stages = Stages::on(Request::of(loaded)?.open()?);
    Checkpoint::find(&folder.checkpoint())?;
    let source = clock.stage("read the CT", 0, |_| source::load(loaded))?;
    let body = clock
        .stage("lattice, skin, incision", 0, |_| Body::build(&BodySections::of(loaded), &source.volume))?;
    let fingerprint = checkpoint::fingerprint(&loaded.scene, &source.sha256);
    let saved = Checkpoint::read(&folder.checkpoint(), &fingerprint, body.mesh.positions.len())
        .map_err(|error| other_scene::explain(error, &folder, &loaded.scene))?;
    // Cuts are made when a frame begins.
    let last_cut_s = f64::from(saved.last_begun().unwrap_or(0)) * loaded.scene.solver.dt_s;
    let warp = BodyWarp::new(&body, &saved.positions, last_cut_s, None, &stages)?;
    let out = &request.out;
    match &request.input {
        ResampleInput::Volume(path) => {
            let volume = match path {
                Some(path) => cutis_volume::read(path, &ReadOptions::default())?.volume,
                None => source.volume,
            };
            resample_volume(&volume, &warp, &mut stages, &mut clock, out)
        }
        ResampleInput::Labels(path) => warp_labels(path, &warp, &mut clock, out),
        ResampleInput::Field(direction) => clock.stage("write the field", 0, |progress| {
            Ok(write_field(out, source.volume.grid(), &warp, *direction, progress)?.report)
        }),
    }
}

fn check_name(request: &ResampleRequest) -> Result<(), Error> {
    let format = Format::of(&request.out)?;
    let detached = request.out.extension().is_some_and(|name| name.eq_ignore_ascii_case("nhdr"));
    if matches!(request.input, ResampleInput::Field(_)) && (format != Format::Nrrd || detached) {
        let (path, expected) = (request.out.clone(), ".nrrd, which holds a displacement field");
        return Err(cutis_volume::VolumeError::Extension { path, expected }.into());
    }
    Ok(())
}

fn resample_volume(
    volume: &Volume,
    warp: &BodyWarp,
    stages: &mut Stages,
    clock: &mut Clock<'_>,
    out: &Path,
) -> Result<Resample, Error> {
    let (deformed, report) = clock.stage("resample", 0, |progress| warp.apply(volume, stages, progress))?;
    stages.notes.iter().for_each(|note| clock.progress.note(note));
    clock.stage("write", 0, |_| Ok(cutis_volume::write(out, &deformed)?))?;
    Ok(report)
}

/// Deforms a label map with nearest neighbors. What the body has left becomes 0.
fn warp_labels(path: &Path, warp: &BodyWarp, clock: &mut Clock<'_>, out: &Path) -> Result<Resample, Error> {
    let (labels, warnings) = LabelMap::read(path)?;
    warnings.iter().for_each(|line| clock.progress.note(&format!("{}: {line}", path.display())));
    let (bytes, report) = clock.stage("resample", 0, |progress| match labels.voxel_bytes() {
        1 => warped::<1>(&labels, warp, progress),
        2 => warped::<2>(&labels, warp, progress),
        4 => warped::<4>(&labels, warp, progress),
        _ => warped::<8>(&labels, warp, progress),
    })?;
    clock.stage("write", 0, |_| Ok(labels.with_bytes(bytes)?.write(out)?))?;
    Ok(report)
}

/// The warped values of a label map with `N` bytes per voxel.
fn warped<const N: usize>(
    labels: &LabelMap,
    warp: &BodyWarp,
    progress: &dyn Progress,
) -> Result<(Vec<u8>, Resample), Error> {
    let (values, _) = labels.bytes().as_chunks::<N>();
    let advance = |done: usize, total: usize| progress.advance_of(done as u64, total as u64);
    let (warped, counts) = resample_labels(labels.grid(), values, [0; N], &warp.warp(), &advance)?;
    let report = Resample {
        moved_voxels: counts.moved_voxels as u64,
        folds: 0,
        vacated_voxels: counts.vacated_voxels as u64,
    };
    Ok((warped.into_flattened(), report))
}
