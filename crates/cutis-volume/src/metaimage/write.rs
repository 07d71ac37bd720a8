//! Writes MetaImage files: int16 HU, LPS, not compressed.

use std::io::{self, BufWriter, Write};
use std::path::Path;

use crate::voxels::{PutVoxels, fits_int16, put_hu};
use crate::{Grid, PartialFile, Volume, VolumeError};

/// Writes a volume to a `.mha` file, or to a `.mhd` header and a `.raw` file next to it.
///
/// HU that are not whole numbers within int16 are written as 32-bit real numbers. A file appears
/// under its name when it is complete, and the header of a pair after the voxels.
///
/// # Errors
/// [`VolumeError::Extension`], [`VolumeError::Sheared`] or [`VolumeError::Io`].
pub fn write(path: impl AsRef<Path>, volume: &Volume) -> Result<(), VolumeError> {
    let int16 = fits_int16(volume);
    let dtype = if int16 { "MET_SHORT" } else { "MET_FLOAT" };
    write_voxels(path.as_ref(), volume.grid(), dtype, &|sink| put_hu(sink, volume, int16))
}

/// Writes the voxels that `put` gives, little-endian.
pub(crate) fn write_voxels(
    path: &Path,
    grid: &Grid,
    dtype: &str,
    put: &PutVoxels<'_>,
) -> Result<(), VolumeError> {
    let extension = path.extension().map(|extension| extension.to_ascii_lowercase());
    let detached = match extension.as_ref().and_then(|extension| extension.to_str()) {
        Some("mha") => false,
        Some("mhd") => true,
        _ => return Err(VolumeError::Extension { path: path.into(), expected: ".mha or .mhd" }),
    };
    if grid.affine.is_sheared() {
        return Err(VolumeError::Sheared { path: path.into(), cosine: grid.affine.shear() });
    }
    let data = path.with_extension("raw");
    let name = data.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let header = header(grid, dtype, if detached { &name } else { "LOCAL" });
    if detached {
        write_file(&data, b"", Some(put))?;
        return write_file(path, header.as_bytes(), None);
    }
    write_file(path, header.as_bytes(), Some(put))
}

/// Writes a header and voxels, or one of them.
fn write_file(path: &Path, header: &[u8], put: Option<&PutVoxels<'_>>) -> Result<(), VolumeError> {
    let mut file = BufWriter::with_capacity(1 << 20, PartialFile::create(path)?);
    let written = (|| -> io::Result<PartialFile> {
        file.write_all(header)?;
        put.map_or(Ok(()), |put| put(&mut file))?;
        file.into_inner().map_err(io::IntoInnerError::into_error)
    })();
    written.map_err(|source| VolumeError::Io { path: path.into(), action: "write", source })?.commit()
}

fn header(grid: &Grid, dtype: &str, data_file: &str) -> String {
    let [nx, ny, nz] = grid.shape;
    let rows = grid.affine.rows();
    let [sx, sy, sz] = grid.affine.spacing_mm();
    let sign = [-1.0, -1.0, 1.0];
    // Adding zero removes the sign of a negative zero.
    let value = |r: usize, v: f64| format!("{:?}", sign[r] * v + 0.0);
    let matrix: Vec<String> = (0..3)
        .flat_map(|c| (0..3).map(move |r| (r, c)))
        .map(|(r, c)| value(r, rows[r][c] / [sx, sy, sz][c]))
        .collect();
    let offset: Vec<String> = (0..3).map(|r| value(r, rows[r][3])).collect();
    format!(
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n\
         TransformMatrix = {}\nOffset = {}\nCenterOfRotation = 0 0 0\nElementSpacing = {sx:?} {sy:?} {sz:?}\n\
         DimSize = {nx} {ny} {nz}\nElementType = {dtype}\nElementDataFile = {data_file}\n",
        matrix.join(" "),
        offset.join(" ")
    )
}
