//! The files of a run folder. A file is written under a temporary name and renamed, so that a run
//! folder never holds a partial file.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use cutis_volume::{PartialFile, VolumeError};
use sha2::{Digest, Sha256};

use super::series;
use crate::scene::OutputSection;
use crate::{Error, Progress};

/// Writes a whole file under a temporary name in the same folder, then renames it.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let mut file = PartialFile::create(path)?;
    file.write_all(bytes).map_err(|e| Error::File {
        path: path.into(),
        action: "write",
        why: e.to_string(),
    })?;
    Ok(file.commit()?)
}

/// Reads a whole file.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>, Error> {
    fs::read(path).map_err(|e| Error::File { path: path.into(), action: "read", why: e.to_string() })
}

/// Creates a folder and its parents.
pub(crate) fn create_folder(path: &Path) -> Result<(), Error> {
    fs::create_dir_all(path).map_err(|e| Error::File {
        path: path.into(),
        action: "create the folder",
        why: e.to_string(),
    })
}

/// Refuses a folder in which no file can be created, also one that does not exist yet. Nothing
/// stays of the attempt.
pub(crate) fn check_writable(folder: &Path) -> Result<(), Error> {
    let refuse =
        |path: &Path, action: &'static str, why: String| Err(Error::File { path: path.into(), action, why });
    let mut existing = folder;
    while !existing.exists() {
        existing = match existing.parent() {
            Some(parent) if parent.as_os_str().is_empty() => Path::new("."),
            Some(parent) => parent,
            None => return refuse(folder, "create the folder", "no folder above it exists".into()),
        };
    }
    if !existing.is_dir() {
        let why = format!("{} is a file", existing.display());
        return refuse(folder, "create the folder", why);
    }
    let action = if existing == folder { "write to the folder" } else { "create the folder" };
    match PartialFile::create(existing.join("probe")) {
        Ok(_) => Ok(()),
        Err(VolumeError::Io { source, .. }) => refuse(folder, action, source.to_string()),
        Err(error) => Err(error.into()),
    }
}

/// SHA-256 of bytes, in hexadecimal digits.
pub(crate) fn sha256_of(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

/// SHA-256 of voxels as little-endian int16, in hexadecimal digits. Takes constant memory.
pub(crate) fn sha256_of_voxels(voxels: &[i16]) -> String {
    let mut hash = Sha256::new();
    let mut buffer = Vec::with_capacity(1 << 16);
    for block in voxels.chunks(1 << 15) {
        buffer.clear();
        buffer.extend(block.iter().flat_map(|v| v.to_le_bytes()));
        hash.update(&buffer);
    }
    hex(&hash.finalize())
}

/// Bytes as hexadecimal digits.
pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// The files of a run folder.
pub struct RunFolder(pub PathBuf);

macro_rules! paths {
    ($($(#[$doc:meta])* $name:ident = $file:literal;)*) => {
        impl RunFolder { $($(#[$doc])* pub fn $name(&self) -> PathBuf { self.0.join($file) })* }
    };
}

paths! {
    /// Versions, sizes, timings, results.
    report = "report.json";
    /// The report for people, with pictures and plots.
    html = "report.html";
    /// The deformed CT.
    volume = "deformed.nii.gz";
    /// The deformed skin.
    skin = "skin.vtu";
    /// The list of the files of a time series.
    series = "skin.pvd";
    /// The folder with the files of a time series.
    series_folder = "skin-series";
    /// The deformed skin without data.
    ply = "skin.ply";
    /// The same in another format.
    stl = "skin.stl";
    /// The deformed tetrahedra.
    tissue = "tissue.vtu";
    /// The displacement from the deformed shape to the rest shape.
    displacement = "displacement.nrrd";
    /// What covers each voxel of the deformed CT.
    coverage = "displacement-coverage.nrrd";
    /// The displacement from the rest shape to the deformed shape.
    displacement_forward = "displacement-forward.nrrd";
    /// One line per frame.
    frames = "frames.csv";
    /// The skin before.
    before = "before.png";
    /// The skin after.
    after = "after.png";
    /// A slice through the wound.
    slice = "slice.png";
    /// The lines of tension on the skin.
    tension = "tension.png";
    /// State from which a run resumes.
    checkpoint = "checkpoint.bin";
}

impl RunFolder {
    /// Removes the unfinished files of killed runs.
    pub(crate) fn remove_abandoned(&self, progress: &dyn Progress) {
        let folders = [self.0.clone(), self.series_folder()];
        let count: usize = folders.iter().map(PartialFile::remove_abandoned).sum();
        if count > 0 {
            let folder = self.0.display();
            progress.note(&format!("removed {count} unfinished files of a killed run from {folder}"));
        }
    }

    /// The files that a run with these outputs writes.
    ///
    /// `has_lines` says whether the body has lines of tension to draw.
    fn written(&self, output: &OutputSection, has_lines: bool) -> Vec<PathBuf> {
        let files = [
            (output.report, self.report()),
            (output.report, self.html()),
            (output.report, self.frames()),
            (output.volume, self.volume()),
            (output.surface, self.skin()),
            (output.series_every > 0, self.series()),
            (output.ply, self.ply()),
            (output.stl, self.stl()),
            (output.tissue, self.tissue()),
            (output.displacement, self.displacement()),
            (output.displacement, self.coverage()),
            (output.displacement_forward, self.displacement_forward()),
            (output.pictures, self.before()),
            (output.pictures, self.after()),
            (output.pictures, self.slice()),
            (output.pictures && has_lines, self.tension()),
        ];
        files.into_iter().filter(|(written, _)| *written).map(|(_, path)| path).collect()
    }

    /// Names of existing files that a run with these outputs does not write, and that no report in
    /// the folder lists. They may belong to the user.
    pub(crate) fn stale_files(&self, output: &OutputSection, has_lines: bool) -> Vec<String> {
        let (written, earlier) = (self.written(output, has_lines), self.of_earlier_run());
        let stale = self.written(&OutputSection::ALL, true).into_iter();
        stale
            .filter(|path| path.exists() && !written.contains(path) && !earlier.contains(path))
            .filter_map(|path| Some(path.file_name()?.to_string_lossy().into_owned()))
            .collect()
    }

    /// Removes the files that an earlier run wrote: those that this run does not write, and the
    /// report, so that a report never lies next to files of another run. Other files stay. Returns
    /// the names of the removed files that this run does not write.
    pub(crate) fn remove_earlier(
        &self,
        output: &OutputSection,
        has_lines: bool,
    ) -> Result<Vec<String>, Error> {
        let (written, mut names) = (self.written(output, has_lines), Vec::new());
        let report = [self.html(), self.frames(), self.report()];
        let earlier = self.of_earlier_run();
        let (of_report, others): (Vec<_>, Vec<_>) =
            earlier.into_iter().partition(|path| report.contains(path));
        if output.series_every == 0 && others.contains(&self.series()) {
            series::remove(self)?;
        }
        // The report goes last: until then it says which files are those of the earlier run.
        for path in others.iter().filter(|path| !written.contains(path)).chain(&of_report) {
            match fs::remove_file(path) {
                Ok(()) if written.contains(path) => {}
                Ok(()) => names.extend(path.file_name().map(|name| name.to_string_lossy().into_owned())),
                Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
                Err(error) => {
                    let why = error.to_string();
                    return Err(Error::File { path: path.clone(), action: "remove", why });
                }
            }
        }
        Ok(names)
    }

    /// The files that an earlier run wrote, as its report says. None without a report of Cutis.
    fn of_earlier_run(&self) -> Vec<PathBuf> {
        let output = || {
            let report: serde_json::Value = serde_json::from_slice(&fs::read(self.report()).ok()?).ok()?;
            report.get("schema")?.as_str().filter(|schema| schema.starts_with("cutis-report/"))?;
            serde_json::from_value::<OutputSection>(report.get("scene")?.get("output")?.clone()).ok()
        };
        output().map(|output| self.written(&output, true)).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A report that is not one of Cutis says nothing about the files next to it.
    #[test]
    fn only_files_that_a_report_of_cutis_lists_are_removed() {
        let here = tempfile::tempdir().unwrap();
        let folder = RunFolder(here.path().into());
        let (all, none) =
            (OutputSection { report: true, volume: true, ..OutputSection::NONE }, OutputSection::NONE);
        let put = |schema: &str| {
            let report = serde_json::json!({ "schema": schema, "scene": { "output": all } });
            fs::write(folder.report(), report.to_string()).unwrap();
            [folder.volume(), folder.skin(), here.path().join("notes.txt")]
                .iter()
                .for_each(|path| fs::write(path, "").unwrap());
        };
        put("someone-else/1");
        assert_eq!(folder.remove_earlier(&none, false).unwrap(), [""; 0]);
        assert_eq!(folder.stale_files(&none, false), ["report.json", "deformed.nii.gz", "skin.vtu"]);
        put("cutis-report/1");
        assert_eq!(folder.stale_files(&none, false), ["skin.vtu"]);
        assert_eq!(folder.remove_earlier(&none, false).unwrap(), ["deformed.nii.gz", "report.json"]);
        assert!(folder.skin().exists() && here.path().join("notes.txt").exists());
        assert!(!folder.volume().exists() && !folder.report().exists());
    }

    #[test]
    fn a_folder_that_cannot_be_written_is_refused_and_nothing_is_left() {
        let here = tempfile::tempdir().unwrap();
        check_writable(&here.path().join("a/b")).unwrap();
        check_writable(here.path()).unwrap();
        assert_eq!(fs::read_dir(here.path()).unwrap().count(), 0);
        fs::write(here.path().join("file"), "").unwrap();
        for folder in [here.path().join("file"), here.path().join("file/run"), "/proc/run".into()] {
            let error = check_writable(&folder).unwrap_err().to_string();
            assert!(error.contains(folder.to_str().unwrap()), "{error}");
        }
    }
}
