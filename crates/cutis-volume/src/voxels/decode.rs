//! Decodes the voxels of an open file into a volume.

use std::path::PathBuf;

use super::convert::{Converter, VoxelType};
use super::second_thread::fill_and_take;
use super::source::{PORTION, Source};
use crate::{Affine, Grid, Loaded, Volume, VolumeError};

/// Where and how a file holds its voxels, as its header says.
pub(crate) struct Layout {
    /// Voxels per axis.
    pub(crate) shape: [u64; 3],
    pub(crate) affine: Affine,
    pub(crate) dtype: VoxelType,
    pub(crate) big_endian: bool,
    /// Slope and intercept of HU.
    pub(crate) scaling: [f64; 2],
    /// Position of the first voxel in the source.
    pub(crate) offset: u64,
}

/// A file whose header is decoded.
pub(crate) struct Opened<'a> {
    pub(crate) source: Source<'a>,
    pub(crate) layout: Layout,
    /// What was noticed in the header.
    pub(crate) warnings: Vec<String>,
    /// Lines of an NRRD header that describe segments.
    pub(crate) segments: Vec<String>,
}

/// Reads all voxels as HU.
///
/// # Errors
/// [`VolumeError::Truncated`], [`VolumeError::TooLarge`], [`VolumeError::Range`],
/// [`VolumeError::Infinite`] or [`VolumeError::Io`].
pub(crate) fn decode(opened: Opened<'_>) -> Result<Loaded, VolumeError> {
    let Opened { mut source, layout, mut warnings, .. } = opened;
    let path: PathBuf = source.path.clone();
    let Layout { shape, affine, dtype, .. } = layout;
    let too_large = || VolumeError::TooLarge { path: path.clone(), shape };
    let mut converter = Converter::new(dtype, layout.big_endian, layout.scaling);
    each_portion(&mut source, &layout, |portion, reserve| {
        if !reserve.is_none_or(|voxels| converter.reserve(voxels)) {
            return Err(too_large());
        }
        converter.push(portion);
        Ok(())
    })?;
    source.check_tail(&mut warnings)?;
    source.finish()?;

    let shape = shape.map(|n| n as usize);
    let converted = converter.finish();
    let stats = converted.stats;
    if let Some((index, value)) = converted.infinite {
        let index = Grid { shape, affine }.point(index);
        return Err(VolumeError::Infinite { path, index, value });
    }
    if !converted.fits {
        return Err(VolumeError::Range { path, min: stats.min, max: stats.max });
    }
    if converted.rounding > 0.0 {
        warnings.push(format!(
            "{} voxels were rounded to whole HU: the largest change is {:.3e} HU",
            dtype.name(),
            converted.rounding
        ));
    }
    if stats.nan_count > 0 {
        warnings.push(format!("{} voxels are NaN: they become air (-1024 HU)", stats.nan_count));
    }
    let volume = Volume::new(
        Grid { shape, affine },
        converted.voxels,
        converted.slope as f32,
        converted.intercept as f32,
    )?;
    Ok(Loaded { volume, stats, dtype: dtype.name(), warnings })
}

/// Reads all voxels as they are, little-endian.
///
/// # Errors
/// [`VolumeError::Truncated`], [`VolumeError::TooLarge`] or [`VolumeError::Io`].
pub(crate) fn decode_raw(source: &mut Source<'_>, layout: &Layout) -> Result<Vec<u8>, VolumeError> {
    let (path, size) = (source.path.clone(), layout.dtype.bytes());
    let too_large = || VolumeError::TooLarge { path: path.clone(), shape: layout.shape };
    let mut bytes: Vec<u8> = Vec::new();
    each_portion(source, layout, |portion, reserve| {
        if let Some(voxels) = reserve {
            let more = voxels.saturating_mul(size).saturating_sub(bytes.len());
            bytes.try_reserve_exact(more).map_err(|_| too_large())?;
        }
        let first = bytes.len();
        bytes.extend_from_slice(portion);
        if layout.big_endian {
            bytes[first..].chunks_exact_mut(size).for_each(<[u8]>::reverse);
        }
        Ok(())
    })?;
    Ok(bytes)
}

/// Calls `visit(portion, reserve)` with the bytes of whole voxels, on a second thread. `reserve` is
/// the number of voxels for which there should be memory from now on, if it has grown.
fn each_portion(
    source: &mut Source<'_>,
    layout: &Layout,
    visit: impl FnMut(&[u8], Option<usize>) -> Result<(), VolumeError> + Send,
) -> Result<(), VolumeError> {
    let &Layout { shape, dtype, .. } = layout;
    let too_large = || VolumeError::TooLarge { path: source.path.clone(), shape };
    let count = shape.iter().try_fold(1u64, |count, &n| count.checked_mul(n)).ok_or_else(too_large)?;
    let bytes = count.checked_mul(dtype.bytes() as u64).ok_or_else(too_large)?;
    let voxels = usize::try_from(count).map_err(|_| too_large())?;
    source.expect(layout.offset, bytes)?;
    source.skip_to(layout.offset, bytes)?;
    let path = source.path.clone();
    let (mut done, mut reserved) = (0, 0);
    let fill = |portion: &mut Vec<u8>| {
        if done == bytes {
            return Ok(None);
        }
        portion.resize(PORTION.min((bytes - done) as usize), 0);
        let got = source.fill(portion)?;
        done += got as u64;
        if got < portion.len() {
            let path = source.path.clone();
            return Err(VolumeError::Truncated { path, expected_bytes: bytes, found_bytes: done });
        }
        let received = (done / dtype.bytes() as u64) as usize;
        if received <= reserved {
            return Ok(Some(None));
        }
        // The size of an uncompressed file is known to suffice. For a compressed file, the reserved
        // memory grows with the voxels received, so that a header with wrong sizes cannot make the
        // program allocate too much.
        reserved =
            if source.compressed { (4 * received).max(source.len as usize).min(voxels) } else { voxels };
        Ok(Some(Some(reserved)))
    };
    fill_and_take(&path, fill, visit)
}
