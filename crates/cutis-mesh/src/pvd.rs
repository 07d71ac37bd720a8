//! Writes the list of files of a time series for ParaView.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use cutis_volume::PartialFile;

use crate::MeshError;

/// Writes a `.pvd` file: the time of each file of a series, s, and its name relative to the list.
///
/// The file appears under its name when it is complete. Names must be plain: letters, digits, `/`,
/// `_`, `-` and `.`.
///
/// # Errors
/// [`MeshError::ArrayName`] for another name, [`MeshError::Volume`] or [`MeshError::Write`] if the
/// file cannot be written.
pub fn write_pvd(path: &Path, files: &[(f64, String)]) -> Result<(), MeshError> {
    let mut text = "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" \
                    byte_order=\"LittleEndian\">\n<Collection>\n"
        .to_owned();
    for (time_s, name) in files {
        if name.is_empty() || !name.chars().all(|c| c.is_ascii_alphanumeric() || "/_-.".contains(c)) {
            return Err(MeshError::ArrayName { path: path.to_path_buf(), name: name.clone() });
        }
        let _ = writeln!(text, "<DataSet timestep=\"{time_s}\" group=\"\" part=\"0\" file=\"{name}\"/>");
    }
    text += "</Collection>\n</VTKFile>\n";
    let mut file = PartialFile::create(path)?;
    let failed = |source| MeshError::Write { path: path.to_path_buf(), source };
    file.write_all(text.as_bytes()).map_err(failed)?;
    Ok(file.commit()?)
}
