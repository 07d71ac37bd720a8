//! Reads a `.mha` file, or a `.mhd` header with its file of voxels.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::header::Header;
use crate::voxels::{Compression, Layout, Observer, Opened, Source, again, data_file, decode, lines};
use crate::{Loaded, VolumeError};

/// Number of bytes in which a header has one of the fields that every image has.
const START: u64 = 512;

/// Whether a file begins with the fields of a MetaImage.
pub(crate) fn is_metaimage(path: &Path) -> bool {
    let mut start = Vec::new();
    let read = File::open(path).and_then(|file| file.take(START).read_to_end(&mut start));
    let text = String::from_utf8_lossy(&start);
    let field = |line: &str| {
        line.split_once('=')
            .is_some_and(|(name, _)| matches!(name.trim(), "ObjectType" | "NDims" | "ElementDataFile"))
    };
    read.is_ok() && text.lines().any(field)
}

/// Reads a MetaImage. Its values are HU, and its frame is LPS as in ITK.
///
/// The voxels may be compressed with zlib. Where `AnatomicalOrientation` contradicts the directions
/// of the axes, the directions count.
///
/// # Errors
/// [`VolumeError::Header`] names the field. [`VolumeError::SeveralVolumes`],
/// [`VolumeError::Truncated`], [`VolumeError::TooLarge`], [`VolumeError::Range`],
/// [`VolumeError::Infinite`] or [`VolumeError::Io`].
pub fn read(path: impl AsRef<Path>) -> Result<Loaded, VolumeError> {
    read_files(path.as_ref(), None)
}

pub(crate) fn read_files(path: &Path, observer: Option<&mut Observer<'_>>) -> Result<Loaded, VolumeError> {
    with_open(path, observer, decode)
}

/// Decodes the header, and passes the file on to `read`.
pub(crate) fn with_open<T>(
    path: &Path,
    mut observer: Option<&mut Observer<'_>>,
    read: impl FnOnce(Opened<'_>) -> Result<T, VolumeError>,
) -> Result<T, VolumeError> {
    let mut source = Source::open_plain(path, again(&mut observer))?;
    // The voxels follow this field.
    let last = |line: &str| line.split_once('=').is_some_and(|(name, _)| name.trim() == "ElementDataFile");
    let lines = lines(&mut source, last)?;
    let mut warnings = Vec::new();
    let header = Header::decode(path, &lines, &mut warnings)?;
    if let Some(name) = &header.data_file {
        source.finish()?;
        source = Source::open_plain(&data_file(path, "ElementDataFile", name)?, again(&mut observer))?;
    }
    let before = source.position();
    if let (true, Some(size)) = (header.compressed, header.compressed_size) {
        source.expect(before, size)?;
    }
    let bytes = header.shape.iter().fold(header.dtype.bytes() as u64, |bytes, &n| bytes.saturating_mul(n));
    let offset = match (header.compressed, header.skip) {
        (true, skip) => {
            source.skip_to(before.saturating_add(skip.unwrap_or(0)), bytes)?;
            source = source.decompress(Compression::Zlib);
            0
        }
        (false, Some(skip)) => before.saturating_add(skip),
        (false, None) => source.len.saturating_sub(bytes).max(before),
    };
    let layout = Layout {
        shape: header.shape,
        affine: header.affine,
        dtype: header.dtype,
        big_endian: header.big_endian,
        scaling: [1.0, 0.0],
        offset,
    };
    read(Opened { source, layout, warnings, segments: Vec::new() })
}
