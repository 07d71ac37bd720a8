//! Writes NRRD files: int16 HU, left-posterior-superior, compressed with gzip.

use std::io::{self, Write};
use std::path::Path;

use crate::voxels::{GzipWriter, PutVoxels, fits_int16, put_hu};
use crate::{Affine, Grid, PartialFile, Volume, VolumeError};

/// Writes a volume to a `.nrrd` file, or to a `.nhdr` header and a `.raw.gz` file next to it.
///
/// HU that are not whole numbers within int16 are written as 32-bit real numbers. A file appears
/// under its name when it is complete, and the header of a pair after the voxels.
///
/// # Errors
/// [`VolumeError::Extension`], [`VolumeError::Sheared`] or [`VolumeError::Io`].
pub fn write(path: impl AsRef<Path>, volume: &Volume) -> Result<(), VolumeError> {
    let int16 = fits_int16(volume);
    let dtype = if int16 { "int16" } else { "float" };
    write_voxels(path.as_ref(), volume.grid(), dtype, &[], &|sink| put_hu(sink, volume, int16))
}

/// Writes the voxels that `put` gives, little-endian. `lines` are further lines of the header.
pub(crate) fn write_voxels(
    path: &Path,
    grid: &Grid,
    dtype: &str,
    lines: &[String],
    put: &PutVoxels<'_>,
) -> Result<(), VolumeError> {
    let extension = path.extension().map(|extension| extension.to_ascii_lowercase());
    let detached = match extension.as_ref().and_then(|extension| extension.to_str()) {
        Some("nrrd") => false,
        Some("nhdr") => true,
        _ => return Err(VolumeError::Extension { path: path.into(), expected: ".nrrd or .nhdr" }),
    };
    if grid.affine.is_sheared() {
        return Err(VolumeError::Sheared { path: path.into(), cosine: grid.affine.shear() });
    }
    let data = path.with_extension("raw.gz");
    let name = detached.then(|| data.file_name().unwrap_or_default().to_string_lossy().into_owned());
    let header = header(grid, dtype, lines, name.as_deref());
    if detached {
        write_file(&data, b"", Some(put))?;
        return write_file(path, header.as_bytes(), None);
    }
    write_file(path, header.as_bytes(), Some(put))
}

/// Writes a header and voxels, or one of them.
fn write_file(path: &Path, header: &[u8], put: Option<&PutVoxels<'_>>) -> Result<(), VolumeError> {
    let mut file = PartialFile::create(path)?;
    let written = (|| -> io::Result<PartialFile> {
        file.write_all(header)?;
        match put {
            None => Ok(file),
            Some(put) => {
                let mut gzip = GzipWriter::new(file)?;
                put(&mut gzip)?;
                gzip.finish()
            }
        }
    })();
    written.map_err(|source| VolumeError::Io { path: path.into(), action: "write", source })?.commit()
}

/// The fields after the kinds of the axes.
pub(super) const ENDING: &str = "endian: little\nencoding: gzip\n";

/// The vectors of `space directions`, and the one of `space origin`.
pub(super) fn geometry(affine: &Affine) -> (String, String) {
    let rows = affine.rows();
    // Adding zero removes the sign of a negative zero.
    let column =
        |c: usize| format!("({:?},{:?},{:?})", -rows[0][c] + 0.0, -rows[1][c] + 0.0, rows[2][c] + 0.0);
    ([column(0), column(1), column(2)].join(" "), column(3))
}

/// The header for voxels of a type on a grid. `data_file` names the file with the voxels, if they
/// do not follow.
fn header(grid: &Grid, dtype: &str, lines: &[String], data_file: Option<&str>) -> String {
    let [nx, ny, nz] = grid.shape;
    let (directions, origin) = geometry(&grid.affine);
    let mut header = format!(
        "NRRD0004\n# written by Cutis\ntype: {dtype}\ndimension: 3\nspace: left-posterior-superior\nsizes: {nx} {ny} {nz}\n\
         space directions: {directions}\nkinds: domain domain domain\n{ENDING}space origin: {origin}\n"
    );
    lines.iter().for_each(|line| header.extend([line, "\n"]));
    match data_file {
        Some(name) => header += &format!("data file: {name}\n"),
        // An empty line ends the header.
        None => header.push('\n'),
    }
    header
}
