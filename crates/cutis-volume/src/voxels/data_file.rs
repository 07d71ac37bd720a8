//! The file of voxels that a header names. It must lie in the folder of the header, so that a
//! header from elsewhere cannot make a program read other files.

use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

use super::text::header_error;
use crate::VolumeError;

/// Longest name, bytes.
const LONGEST: usize = 1024;

/// The path of the file `name`, which the field of a header names. A file that does not exist is
/// not an error here.
///
/// # Errors
/// [`VolumeError::Header`] for an absolute name, for one with `..`, and for a link that leads out
/// of the folder.
pub(crate) fn data_file(header: &Path, field: &'static str, name: &str) -> Result<PathBuf, VolumeError> {
    let refuse = |expected| Err(header_error(header, field, name, expected));
    let is_inside = |part: Component<'_>| matches!(part, Component::Normal(_) | Component::CurDir);
    if name.len() > LONGEST || !Path::new(name).components().all(is_inside) {
        return refuse("the name of a file in the folder of the header");
    }
    let path = header.with_file_name(name);
    let Ok(real) = path.canonicalize() else { return Ok(path) };
    // The header itself may be a link to a folder with both files.
    let of_target = header.canonicalize().ok().and_then(|header| Some(header.parent()?.to_owned()));
    let folders = [header.with_file_name(".").canonicalize().ok(), of_target];
    match folders.iter().flatten().any(|folder| real.starts_with(folder)) {
        true => Ok(path),
        false => refuse("a file in the folder of the header, and not a link that leads out of it"),
    }
}

/// Refuses what is neither a file nor missing. Opening a pipe would wait for a writer.
pub(crate) fn require_file(path: &Path) -> Result<(), VolumeError> {
    match fs::metadata(path) {
        Ok(facts) if !facts.is_file() => {
            let source = io::Error::new(io::ErrorKind::InvalidInput, "it is not a regular file");
            Err(VolumeError::Io { path: path.into(), action: "read", source })
        }
        _ => Ok(()),
    }
}
