//! Writes NRRD files: int16 HU, left-posterior-superior, compressed with gzip.

use std::io::{self, Write};
use std::path::Path;

use crate::voxels::{GzipWriter, fits_int16, put_hu};
use crate::{PartialFile, Volume, VolumeError};

/// Writes a volume to a `.nrrd` file, or to a `.nhdr` header and a `.raw.gz` file next to it.
///
/// HU that are not whole numbers within int16 are written as 32-bit real numbers. A file appears
/// under its name when it is complete, and the header of a pair after the voxels.
///
/// # Errors
/// [`VolumeError::Extension`], [`VolumeError::Sheared`] or [`VolumeError::Io`].
pub fn write(path: impl AsRef<Path>, volume: &Volume) -> Result<(), VolumeError> {
    let path = path.as_ref();
    let extension = path.extension().map(|extension| extension.to_ascii_lowercase());
    let detached = match extension.as_ref().and_then(|extension| extension.to_str()) {
        Some("nrrd") => false,
        Some("nhdr") => true,
        _ => return Err(VolumeError::Extension { path: path.into(), expected: ".nrrd or .nhdr" }),
    };
    let affine = &volume.grid().affine;
    if affine.is_sheared() {
        return Err(VolumeError::Sheared { path: path.into(), cosine: affine.shear() });
    }
    let int16 = fits_int16(volume);
    let data = path.with_extension("raw.gz");
    let name = detached.then(|| data.file_name().unwrap_or_default().to_string_lossy().into_owned());
    let header = header(volume, int16, name.as_deref());
    if detached {
        put(PartialFile::create(&data)?, b"", Some(volume), int16, &data)?;
        return put(PartialFile::create(path)?, header.as_bytes(), None, int16, path);
    }
    put(PartialFile::create(path)?, header.as_bytes(), Some(volume), int16, path)
}

/// Writes a header and voxels, or one of them.
fn put(
    mut file: PartialFile,
    header: &[u8],
    volume: Option<&Volume>,
    int16: bool,
    path: &Path,
) -> Result<(), VolumeError> {
    let written = (|| -> io::Result<PartialFile> {
        file.write_all(header)?;
        match volume {
            None => Ok(file),
            Some(volume) => {
                let mut gzip = GzipWriter::new(file)?;
                put_hu(&mut gzip, volume, int16)?;
                gzip.finish()
            }
        }
    })();
    written.map_err(|source| VolumeError::Io { path: path.into(), action: "write", source })?.commit()
}

fn header(volume: &Volume, int16: bool, data_file: Option<&str>) -> String {
    let grid = volume.grid();
    let [nx, ny, nz] = grid.shape;
    let rows = grid.affine.rows();
    // Adding zero removes the sign of a negative zero.
    let column =
        |c: usize| format!("({:?},{:?},{:?})", -rows[0][c] + 0.0, -rows[1][c] + 0.0, rows[2][c] + 0.0);
    let dtype = if int16 { "int16" } else { "float" };
    let mut header = format!(
        "NRRD0004\n# written by Cutis\ntype: {dtype}\ndimension: 3\nspace: left-posterior-superior\nsizes: {nx} {ny} {nz}\n\
         space directions: {} {} {}\nkinds: domain domain domain\nendian: little\nencoding: gzip\nspace origin: {}\n",
        column(0),
        column(1),
        column(2),
        column(3)
    );
    match data_file {
        Some(name) => header += &format!("data file: {name}\n"),
        // An empty line ends the header.
        None => header.push('\n'),
    }
    header
}
