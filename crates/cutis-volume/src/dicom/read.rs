//! Reads one series into a volume.

use std::path::Path;

use rayon::prelude::*;

use super::error::DicomError;
use super::file;
use super::pixels::{self, Pixels};
use super::series::{Folder, Series};
use super::slice::Slice;
use super::stack::Stack;
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
    for batch in slices.chunks(BATCH) {
        let mut files = Vec::with_capacity(batch.len());
        for slice in batch {
            let bytes = file::bytes(&slice.path)?;
            if let Some(observer) = &mut observer {
                observer(&slice.path, &bytes);
            }
            files.push(bytes);
        }
        let decoded: Vec<Result<Pixels, DicomError>> =
            batch.par_iter().zip(&files).map(|(slice, bytes)| decode_slice(slice, bytes)).collect();
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

/// Decodes one slice from the bytes of its file.
pub(super) fn decode_slice(slice: &Slice, bytes: &[u8]) -> Result<Pixels, DicomError> {
    pixels::decode(slice, &file::parse(&slice.path, bytes, true)?)
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
