//! Reads an NRRD file, or a `.nhdr` header with its file of voxels.

use std::path::Path;

use super::MAGIC;
use super::header::{Encoding, Header};
use crate::voxels::{
    Compression, Layout, Observer, Opened, Source, again, data_file, decode, header_error, lines,
};
use crate::{Loaded, VolumeError};

/// Reads an NRRD file. Its values are HU.
///
/// The encodings `raw` and `gzip` are supported, and the spaces left-posterior-superior,
/// right-anterior-superior and left-anterior-superior. The position of a voxel is that of its
/// center, with `centerings: node` too.
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
    let lines = lines(&mut source, str::is_empty)?;
    let magic = lines[0].as_bytes();
    if !magic.starts_with(MAGIC) || !matches!(magic.get(MAGIC.len()..), Some([b'1'..=b'5'])) {
        return Err(header_error(path, "magic", &lines[0], "NRRD0001 to NRRD0005"));
    }
    let mut warnings = Vec::new();
    let header = Header::decode(path, &lines[1..], &mut warnings)?;
    if let Some(name) = &header.data_file {
        source.finish()?;
        source = Source::open_plain(&data_file(path, "data file", name)?, again(&mut observer))?;
    }
    let before = source.position();
    if header.encoding == Encoding::Gzip {
        source = source.decompress(Compression::Gzip);
    }
    let bytes = header.shape.iter().fold(header.dtype.bytes() as u64, |bytes, &n| bytes.saturating_mul(n));
    let offset = match header.skip {
        Some(skip) if header.encoding == Encoding::Gzip => skip,
        Some(skip) => before.saturating_add(skip),
        None => source.len.saturating_sub(bytes).max(before),
    };
    let layout = Layout {
        shape: header.shape,
        affine: header.affine,
        dtype: header.dtype,
        big_endian: header.big_endian,
        scaling: [1.0, 0.0],
        offset,
    };
    let of_segment = |line: &&String| line.starts_with("Segment") && line.contains(":=");
    let segments = lines.iter().filter(of_segment).cloned().collect();
    read(Opened { source, layout, warnings, segments })
}
