//! The folder of a sweep, and which of its cases are done.

use std::path::{Path, PathBuf};

use super::cases::Case;
use super::identity::Hashes;
use super::journal::{self, Entry, Journal};
use super::study::{self, Study};
use crate::Error;
use crate::run::files::{self, RunFolder};

/// The folder of a sweep.
#[derive(Clone, Debug)]
pub struct Folder(pub PathBuf);

/// Whether a case must run.
#[derive(Clone, Debug, PartialEq)]
pub enum CaseState {
    /// It never ran.
    New,
    /// It ran, and journal, report, settings and inputs agree.
    Done(Entry),
    /// It failed with these settings.
    Failed(Entry),
    /// It ran, but something is different now: this.
    Changed(String),
}

impl CaseState {
    /// Whether the case is done.
    pub fn is_done(&self) -> bool {
        matches!(self, Self::Done(_))
    }

    /// The state in one or some words.
    pub fn name(&self) -> String {
        match self {
            Self::New => "new".into(),
            Self::Done(_) => "done".into(),
            Self::Failed(_) => "failed".into(),
            Self::Changed(what) => format!("changed: {what}"),
        }
    }
}

impl Folder {
    /// The run folder of a case.
    pub fn of_case(&self, case: &Case) -> RunFolder {
        RunFolder(self.0.join("cases").join(&case.name))
    }

    /// What a case prints while it runs.
    pub fn log(&self, case: &Case) -> PathBuf {
        self.of_case(case).0.join("log.txt")
    }

    /// The table of results.
    pub fn table(&self) -> PathBuf {
        self.0.join("table.csv")
    }

    /// The page with plots.
    pub fn plots(&self) -> PathBuf {
        self.0.join("plots.html")
    }

    /// The journal of a case.
    pub(super) fn journal(&self, case: &Case) -> PathBuf {
        self.0.join("journal").join(format!("{}.jsonl", case.name))
    }

    /// Refuses a folder that cannot be written, and creates the parts that all cases share.
    ///
    /// # Errors
    /// [`Error::File`] if the folder cannot be created or written.
    pub fn create(&self) -> Result<(), Error> {
        files::check_writable(&self.0)?;
        files::create_folder(&self.0.join("journal"))
    }

    /// Opens the journal of a case and creates the run folder.
    pub(super) fn open(&self, case: &Case, wait: impl FnOnce()) -> Result<Journal, Error> {
        self.create()?;
        files::create_folder(&self.of_case(case).0)?;
        Journal::open(&self.journal(case), wait)
    }

    /// Whether a case must run. A case is done if its journal, its report, its settings and the
    /// bytes of its inputs agree.
    ///
    /// # Errors
    /// [`Error::File`] if the journal cannot be read.
    pub fn state(&self, study: &Study, case: &Case, hashes: &mut Hashes) -> Result<CaseState, Error> {
        let (entry, _) = journal::last(&self.journal(case))?;
        entry.map_or(Ok(CaseState::New), |entry| self.state_after(&study.file, case, entry, hashes))
    }

    /// The state of a case whose last line in the journal is `entry`.
    pub(super) fn state_after(
        &self,
        study: &Path,
        case: &Case,
        entry: Entry,
        hashes: &mut Hashes,
    ) -> Result<CaseState, Error> {
        if entry.settings_sha256 != case.settings_sha256 {
            return Ok(CaseState::Changed("settings, or the version of the program".into()));
        }
        let Some(wanted) = &entry.report_sha256 else { return Ok(CaseState::Failed(entry)) };
        let report = std::fs::read(self.of_case(case).report());
        if report.map(|bytes| files::sha256_of(&bytes)).ok().as_ref() != Some(wanted) {
            return Ok(CaseState::Changed("report.json is not the one that the case wrote".into()));
        }
        let loaded = study::load(study, case)?;
        Ok(match hashes.of(&loaded) {
            Ok(found) if found == entry.inputs_sha256 => CaseState::Done(entry),
            Ok(_) => CaseState::Changed("an input file".into()),
            Err(why) => CaseState::Changed(format!("an input file: {why}")),
        })
    }
}
