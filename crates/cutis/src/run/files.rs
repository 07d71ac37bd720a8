//! The files of a run folder. A file is written under a temporary name and renamed, so that a run
//! folder never holds a partial file.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use cutis_volume::PartialFile;
use sha2::{Digest, Sha256};

use crate::Error;
use crate::scene::OutputSection;

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
    /// The deformed tetrahedra.
    tissue = "tissue.vtu";
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
    /// Names of existing files that a run with these outputs does not write.
    ///
    /// `has_lines` says whether the body has lines of tension to draw.
    pub(crate) fn stale_files(&self, output: &OutputSection, has_lines: bool) -> Vec<String> {
        let files = [
            (output.report, self.report()),
            (output.report, self.html()),
            (output.report, self.frames()),
            (output.volume, self.volume()),
            (output.surface, self.skin()),
            (output.tissue, self.tissue()),
            (output.pictures, self.before()),
            (output.pictures, self.after()),
            (output.pictures, self.slice()),
            (output.pictures && has_lines, self.tension()),
        ];
        let stale = files.iter().filter(|(written, path)| !written && path.exists());
        stale.filter_map(|(_, path)| Some(path.file_name()?.to_string_lossy().into_owned())).collect()
    }
}
