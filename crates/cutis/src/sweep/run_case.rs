//! Runs one case, and keeps in its journal how it ended.

use std::path::Path;
use std::time::Instant;

use super::cases::Case;
use super::folder::{CaseState, Folder};
use super::identity::{self, Hashes};
use super::journal::Entry;
use super::study;
use crate::report::Report;
use crate::run::files;
use crate::{Error, Progress, RunOptions};

/// How a call of [`run_case`] ended.
#[derive(Debug)]
pub enum Ran {
    /// The case ran.
    Now(Box<Report>),
    /// It was done before.
    Before,
}

/// Runs a case of the study file `study` in its run folder unless it is done, with `threads`
/// threads (0: all cores), and adds a line to its journal. Waits while another process runs it.
///
/// # Errors
/// The errors of [`run`](crate::run()), which the journal keeps, and [`Error::File`] if the folder
/// cannot be written.
pub fn run_case(
    study: &Path,
    case: &Case,
    folder: &Folder,
    threads: usize,
    progress: &dyn Progress,
) -> Result<Ran, Error> {
    let wait = || progress.note("another process runs this case; waiting for it");
    let mut journal = folder.open(case, wait)?;
    if let (Some(entry), _) = journal.last()?
        && let CaseState::Done(_) = folder.state_after(study, case, entry, &mut Hashes::default())?
    {
        return Ok(Ran::Before);
    }
    let start = Instant::now();
    let result = run(study, case, folder, threads, progress);
    let seconds = start.elapsed().as_secs_f64();
    let mut entry = Entry {
        case: case.name.clone(),
        cutis_version: env!("CARGO_PKG_VERSION").into(),
        settings_sha256: case.settings_sha256.clone(),
        inputs_sha256: Vec::new(),
        report_sha256: None,
        error: None,
        exit: Some(0),
        seconds,
    };
    match result {
        Ok((report, inputs, sha256)) => {
            (entry.inputs_sha256, entry.report_sha256) = (inputs, Some(sha256));
            journal.append(&entry)?;
            Ok(Ran::Now(Box::new(report)))
        }
        Err(error) => {
            (entry.error, entry.exit) = (Some(error.to_string()), Some(error.exit_code().into()));
            journal.append(&entry)?;
            Err(error)
        }
    }
}

/// The run itself. Returns the report, and the hashes of inputs and report.
fn run(
    study: &Path,
    case: &Case,
    folder: &Folder,
    threads: usize,
    progress: &dyn Progress,
) -> Result<(Report, Vec<String>, String), Error> {
    let mut loaded = study::load(study, case)?;
    if loaded.scene.solver.threads == 0 {
        loaded.scene.solver.threads = threads;
    }
    let options = RunOptions { out: folder.of_case(case).0, resume: false };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|e| Error::Request { what: format!("{threads} threads"), why: e.to_string() })?;
    let report = pool.install(|| crate::run(&loaded, &options, progress))?;
    let volume = loaded.scene.volume.path.as_ref().and(report.inputs.get(1));
    let inputs = identity::after_run(&loaded.scene, volume.map(|input| input.sha256.as_str()))?;
    let sha256 = files::sha256_of(&files::read(&folder.of_case(case).report())?);
    Ok((report, inputs, sha256))
}

/// Adds a line for a case whose process ended without one: a signal or a panic ended it.
/// `lines_before` is the number of lines when it began, as [`Folder::lines`] counts them.
///
/// # Errors
/// [`Error::File`] if the journal cannot be written.
pub fn record_death(
    case: &Case,
    folder: &Folder,
    lines_before: usize,
    exit: Option<i32>,
    why: &str,
    seconds: f64,
) -> Result<(), Error> {
    let mut journal = folder.open(case, || {})?;
    if journal.last()?.1 > lines_before {
        return Ok(());
    }
    journal.append(&Entry {
        case: case.name.clone(),
        cutis_version: env!("CARGO_PKG_VERSION").into(),
        settings_sha256: case.settings_sha256.clone(),
        inputs_sha256: Vec::new(),
        report_sha256: None,
        error: Some(why.into()),
        exit,
        seconds,
    })
}

impl Folder {
    /// Number of lines in the journal of a case.
    ///
    /// # Errors
    /// [`Error::File`] if it cannot be read.
    pub fn lines(&self, case: &Case) -> Result<usize, Error> {
        Ok(super::journal::last(&self.journal(case))?.1)
    }
}
