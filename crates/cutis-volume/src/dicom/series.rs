//! The series in a folder, and the choice of one.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::error::DicomError;
use super::slice::{self, Found, Identity, Other, Slice};
use crate::VolumeError;

/// Most files of a folder with its subfolders.
const MOST_FILES: usize = 100_000;
/// Deepest subfolder.
const DEEPEST: usize = 8;

/// Slices of one series that have the same size and orientation, or files of it that cannot be
/// read.
pub(super) struct Series {
    pub(super) identity: Identity,
    pub(super) slices: Vec<Slice>,
    /// Why the series cannot be read.
    pub(super) failure: Option<DicomError>,
    files: Vec<PathBuf>,
    /// Number of slices. A file that cannot be read counts as one.
    count: usize,
}

impl Series {
    /// One line: number, description, slices and size.
    pub(super) fn line(&self) -> String {
        let number =
            self.identity.number.map_or("without number".into(), |number| format!("series {number}"));
        let mut line = format!("  {number}: \"{}\", {} slices", self.identity.description, self.count);
        if let Some(slice) = self.slices.first() {
            line += &format!(" of {} x {} pixels", slice.size[0], slice.size[1]);
        }
        line
    }

    pub(super) fn len(&self) -> usize {
        self.count
    }

    pub(super) fn first_file(&self) -> &Path {
        &self.files[0]
    }

    fn line_with_file(&self) -> String {
        format!("{}: {}", self.line(), self.first_file().display())
    }
}

/// Everything in a folder.
pub(super) struct Folder {
    /// The path given by the user.
    path: PathBuf,
    pub(super) series: Vec<Series>,
    /// Number of files of each other kind.
    pub(super) others: BTreeMap<Other, usize>,
    /// The files that are damaged. Each may be a slice of any series.
    pub(super) damaged: Vec<VolumeError>,
}

impl Folder {
    /// Reads the headers of all files in a folder and its subfolders, or of the folder of a file.
    pub(super) fn scan(path: &Path) -> Result<Self, VolumeError> {
        let mut files = Vec::new();
        if path.is_dir() {
            collect(path, path, DEEPEST, &mut files)?;
        } else {
            let folder =
                path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
            collect(path, folder, 0, &mut files)?;
            // The path as the user gave it, so that it is found again.
            files.retain(|file| file.file_name() != path.file_name());
            files.push(path.into());
        }
        files.sort();
        let found: Vec<Result<Found, VolumeError>> = files.par_iter().map(|file| slice::read(file)).collect();
        let mut folder =
            Self { path: path.into(), series: Vec::new(), others: BTreeMap::new(), damaged: Vec::new() };
        for (file, found) in files.into_iter().zip(found) {
            match found {
                Ok(Found::Slices { identity, slices }) => folder.add_file(&file, &identity, slices),
                Ok(Found::Other(other)) => *folder.others.entry(other).or_default() += 1,
                Err(error) => folder.damaged.push(error),
            }
        }
        folder
            .series
            .sort_by(|a, b| (a.identity.number, a.first_file()).cmp(&(b.identity.number, b.first_file())));
        Ok(folder)
    }

    fn add_file(&mut self, file: &Path, identity: &Identity, slices: Result<Vec<Slice>, DicomError>) {
        match slices {
            Ok(slices) => slices.into_iter().for_each(|slice| self.add(file, identity, Ok(slice))),
            Err(error) => self.add(file, identity, Err(error)),
        }
    }

    fn add(&mut self, file: &Path, identity: &Identity, slice: Result<Slice, DicomError>) {
        let group = self.series.iter_mut().find(|series| {
            let alike = match (&slice, series.slices.first()) {
                (Ok(slice), Some(first)) => slice.matches(first),
                _ => true,
            };
            series.identity.uid == identity.uid && series.identity.number == identity.number && alike
        });
        let series = match group {
            Some(series) => series,
            None => {
                self.series.push(Series {
                    identity: identity.clone(),
                    slices: Vec::new(),
                    failure: None,
                    files: Vec::new(),
                    count: 0,
                });
                self.series.last_mut().expect("one was added")
            }
        };
        if series.files.last().is_none_or(|last| last != file) {
            series.files.push(file.into());
        }
        series.count += 1;
        match slice {
            Ok(slice) => series.slices.push(slice),
            Err(error) => series.failure = series.failure.take().or(Some(error)),
        }
    }

    /// The series with this number, that of the given file, or the only one.
    pub(super) fn choose(mut self, number: Option<u32>) -> Result<Series, VolumeError> {
        let path = self.path.clone();
        if !self.damaged.is_empty() {
            return Err(self.damaged.swap_remove(0));
        }
        if path.is_file() {
            self.series.retain(|series| series.files.contains(&path));
        }
        let all: Vec<String> = self.series.iter().map(Series::line).collect();
        if all.is_empty() {
            return Err(DicomError::NoSeries { path, found: self.describe_others() }.into());
        }
        if let Some(number) = number {
            self.series.retain(|series| series.identity.number == Some(number));
        }
        let chosen = self.series.pop();
        let refused = match (chosen, number) {
            (Some(only), _) if self.series.is_empty() => return Ok(only),
            (Some(last), Some(number)) => {
                self.series.push(last);
                let series = self.series.iter().map(Series::line_with_file).collect();
                DicomError::AmbiguousSeries { path, number, series }
            }
            (None, Some(number)) => DicomError::NoSuchSeries { path, number, series: all },
            (_, None) => DicomError::SeveralSeries { path, series: all },
        };
        Err(refused.into())
    }

    pub(super) fn describe_others(&self) -> String {
        match self.others.is_empty() {
            true => "the folder is empty".into(),
            false => {
                let kinds: Vec<String> =
                    self.others.iter().map(|(other, &count)| other.describe(count)).collect();
                kinds.join(", ")
            }
        }
    }
}

/// Collects the regular files of a folder, and of its subfolders down to a depth.
fn collect(given: &Path, folder: &Path, depth: usize, files: &mut Vec<PathBuf>) -> Result<(), VolumeError> {
    let failed = |source| VolumeError::Io { path: folder.into(), action: "read", source };
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let kind = entry.file_type().map_err(failed)?;
        if kind.is_dir() && depth > 0 {
            collect(given, &entry.path(), depth - 1, files)?;
        } else if kind.is_file() || (kind.is_symlink() && entry.path().is_file()) {
            if files.len() == MOST_FILES {
                return Err(DicomError::TooManyFiles { path: given.into(), most: MOST_FILES }.into());
            }
            files.push(entry.path());
        }
    }
    Ok(())
}
