//! Reads one series into a volume.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use dicom_object::DefaultDicomObject;
use rayon::prelude::*;

use super::error::DicomError;
use super::pixels::{self, Pixels};
use super::series::{Folder, Series};
use super::slice::Slice;
use super::stack::Stack;
use super::{file, frames};
use crate::regrid::{Slices, regrid};
use crate::voxels::Observer;
use crate::{Grid, HuStats, Loaded, ReadOptions, Volume, VolumeError};

/// Slices that are in memory as files at one time.
const BATCH: usize = 16;

/// Reads a series, given by its folder or one of its files.
///
/// # Errors
/// [`VolumeError::Dicom`], [`VolumeError::Io`], [`VolumeError::Range`] or
/// [`VolumeError::TooLarge`].
pub(crate) fn read_series(
    path: &Path,
    options: &ReadOptions,
    observer: Option<&mut Observer<'_>>,
) -> Result<Loaded, VolumeError> {
    let folder = Folder::scan(path)?;
    let mut warnings = Vec::new();
    if !folder.others.is_empty() && path.is_dir() {
        warnings.push(format!("the folder has other files, which are ignored: {}", folder.describe_others()));
    }
    let series = folder.choose(options.series)?;
    let stack = stack(series)?;
    if stack.slices.iter().any(|slice| slice.lossy) {
        warnings.push("the pixels were compressed with a loss: their HU are not those of the scanner".into());
    }
    if !options.resample || stack.is_regular() {
        stack.require_regular(path, &mut warnings)?;
        return load(path, &stack, observer, warnings);
    }
    resample(path, &stack, observer, warnings)
}

/// The slices of a series in order.
pub(super) fn stack(series: Series) -> Result<Stack, DicomError> {
    match series.failure {
        Some(error) => Err(error),
        None => Stack::new(series.slices),
    }
}

fn load(
    path: &Path,
    stack: &Stack,
    observer: Option<&mut Observer<'_>>,
    mut warnings: Vec<String>,
) -> Result<Loaded, VolumeError> {
    let decoded = decode(path, stack, observer)?;
    decoded.warn(&mut warnings);
    let [nx, ny] = stack.slices[0].size;
    let affine = stack.affine(stack.step_mm(), [0.0; 3])?;
    let grid = Grid { shape: [nx, ny, stack.slices.len()], affine };
    let (stats, dtype) = (decoded.stats, decoded.dtype);
    Ok(Loaded { volume: Volume::new(grid, decoded.hu, 1.0, 0.0)?, stats, dtype, warnings })
}

fn resample(
    path: &Path,
    stack: &Stack,
    observer: Option<&mut Observer<'_>>,
    mut warnings: Vec<String>,
) -> Result<Loaded, VolumeError> {
    let decoded = decode(path, stack, observer)?;
    decoded.warn(&mut warnings);
    let first = &stack.slices[0];
    let slices = Slices {
        hu: &|n| f32::from(decoded.hu[n]),
        size: first.size,
        spacing_mm: first.spacing_mm,
        along_mm: &stack.along_mm,
        shift_mm: &stack.shift_mm,
    };
    let too_large = || VolumeError::TooLarge {
        path: path.into(),
        shape: [first.size[0] as u64, first.size[1] as u64, stack.slices.len() as u64],
    };
    let new = regrid(&slices).ok_or_else(too_large)?;
    let [least, most] = stack.gap_range_mm().unwrap_or([new.step_mm; 2]);
    warnings.push(format!(
        "the slices are tilted by {:.1} degrees and {least:.3} to {most:.3} mm apart: they were resampled to perpendicular axes \
         and a distance of {:.3} mm",
        stack.tilt_deg(),
        new.step_mm
    ));
    let grid = Grid { shape: new.shape, affine: stack.affine(new.step_mm, new.origin_mm)? };
    let (stats, dtype) = (decoded.stats, decoded.dtype);
    Ok(Loaded { volume: Volume::new(grid, new.hu, 1.0, 0.0)?, stats, dtype, warnings })
}

/// The HU of all slices.
pub(super) struct Decoded {
    hu: Vec<i16>,
    pub(super) stats: HuStats,
    dtype: &'static str,
    rounding: f64,
    padding: u64,
}

impl Decoded {
    fn warn(&self, warnings: &mut Vec<String>) {
        if self.rounding > 0.0 {
            warnings.push(format!(
                "HU were rounded to whole numbers: the largest change is {:.3e} HU",
                self.rounding
            ));
        }
        if self.padding > 0 {
            warnings.push(format!(
                "{} voxels have the PixelPaddingValue: they become air (-1024 HU)",
                self.padding
            ));
        }
    }
}

/// Decodes all slices, some at a time. The observer sees the files in the order of the slices.
fn decode(
    path: &Path,
    stack: &Stack,
    mut observer: Option<&mut Observer<'_>>,
) -> Result<Decoded, VolumeError> {
    let slices = &stack.slices;
    let [nx, ny] = slices[0].size;
    let mut hu: Vec<i16> = Vec::new();
    let mut total = Total::default();
    let mut files = Files::default();
    for batch in slices.chunks(BATCH) {
        files.open(batch, &mut observer)?;
        let decoded: Vec<Result<Pixels, DicomError>> =
            batch.par_iter().map(|slice| decode_slice(slice, files.of(slice))).collect();
        for pixels in decoded {
            let pixels = pixels?;
            total.add(&pixels);
            if hu.is_empty() && hu.try_reserve_exact(nx * ny * slices.len()).is_err() {
                let shape = [nx as u64, ny as u64, slices.len() as u64];
                return Err(VolumeError::TooLarge { path: path.into(), shape });
            }
            hu.extend(&pixels.hu);
        }
    }
    let stats = total.stats();
    let fits = |hu: f64| hu.is_nan() || (f64::from(i16::MIN)..=f64::from(i16::MAX)).contains(&hu.round());
    if !fits(stats.min) || !fits(stats.max) {
        return Err(VolumeError::Range { path: path.into(), min: stats.min, max: stats.max });
    }
    let format = slices[0].format;
    let dtype = match (format.bits_allocated, format.signed) {
        (8, true) => "int8",
        (8, false) => "uint8",
        (_, true) => "int16",
        (_, false) => "uint16",
    };
    Ok(Decoded { hu, stats, dtype, rounding: total.rounding, padding: total.padding })
}

/// Decodes one slice of a parsed file.
pub(super) fn decode_slice(slice: &Slice, object: &DefaultDicomObject) -> Result<Pixels, DicomError> {
    match slice.source.frame {
        None => pixels::decode(slice, object),
        Some(_) => pixels::decode(slice, &frames::single(slice, object)?),
    }
}

/// The parsed files of some slices. A file with several slices stays until no slice needs it.
#[derive(Default)]
struct Files {
    open: BTreeMap<PathBuf, DefaultDicomObject>,
    seen: BTreeSet<PathBuf>,
}

impl Files {
    /// Opens the files of these slices and closes all others. The observer sees each file once.
    fn open(
        &mut self,
        slices: &[Slice],
        observer: &mut Option<&mut Observer<'_>>,
    ) -> Result<(), VolumeError> {
        let mut kept = BTreeMap::new();
        let mut new: Vec<(&Path, Vec<u8>)> = Vec::new();
        for slice in slices {
            let path = &slice.source.path;
            if let Some((path, object)) = self.open.remove_entry(path) {
                kept.insert(path, object);
            } else if !kept.contains_key(path) && new.iter().all(|(known, _)| known != path) {
                let bytes = file::bytes(path)?;
                if let Some(observer) = observer
                    && self.seen.insert(path.clone())
                {
                    observer(path, &bytes);
                }
                new.push((path, bytes));
            }
        }
        let parsed: Vec<Result<(PathBuf, DefaultDicomObject), DicomError>> = new
            .into_par_iter()
            .map(|(path, bytes)| Ok((path.into(), file::parse(path, &bytes, true)?)))
            .collect();
        for file in parsed {
            let (path, object) = file?;
            kept.insert(path, object);
        }
        self.open = kept;
        Ok(())
    }

    /// The file of a slice that was opened.
    fn of(&self, slice: &Slice) -> &DefaultDicomObject {
        &self.open[&slice.source.path]
    }
}

/// Statistics of several slices.
#[derive(Default)]
pub(super) struct Total {
    range: Option<[f64; 2]>,
    sum: f64,
    rounding: f64,
    padding: u64,
}

impl Total {
    pub(super) fn add(&mut self, pixels: &Pixels) {
        if pixels.min <= pixels.max {
            let [min, max] = self.range.unwrap_or([pixels.min, pixels.max]);
            self.range = Some([min.min(pixels.min), max.max(pixels.max)]);
        }
        self.sum += pixels.sum;
        self.rounding = self.rounding.max(pixels.rounding);
        self.padding += pixels.padding;
    }

    pub(super) fn stats(&self) -> HuStats {
        let [min, max] = self.range.unwrap_or([f64::NAN; 2]);
        HuStats { min, max, sum: self.sum, nan_count: 0 }
    }
}
