//! Stored voxels of any real type → int16 with slope and intercept, one portion at a time.
//!
//! Types of 8 and 16 bits keep their slope and intercept; uint16 above 32767 is stored shifted by 32768, with the intercept
//! moved along. Wider types are stored as HU rounded to whole numbers (slope 1), which CT reconstructions are anyway; the largest
//! rounding error is kept.

use super::read::HuStats;
use crate::AIR_HU;

/// Voxel types that hold one real number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum VoxelType {
    U8,
    I8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl VoxelType {
    /// From the header's `datatype`; the name of the type where it is none of ours.
    pub(super) fn from_code(code: i16) -> Result<Self, &'static str> {
        Ok(match code {
            2 => Self::U8,
            4 => Self::I16,
            8 => Self::I32,
            16 => Self::F32,
            64 => Self::F64,
            256 => Self::I8,
            512 => Self::U16,
            768 => Self::U32,
            1024 => Self::I64,
            1280 => Self::U64,
            1 => return Err("binary"),
            32 => return Err("complex64"),
            128 => return Err("RGB24"),
            1536 => return Err("float128"),
            1792 => return Err("complex128"),
            2048 => return Err("complex256"),
            2304 => return Err("RGBA32"),
            _ => return Err("unknown"),
        })
    }

    pub(super) fn bytes(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// Numpy's name.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::U8 => "uint8",
            Self::I8 => "int8",
            Self::I16 => "int16",
            Self::U16 => "uint16",
            Self::I32 => "int32",
            Self::U32 => "uint32",
            Self::I64 => "int64",
            Self::U64 => "uint64",
            Self::F32 => "float32",
            Self::F64 => "float64",
        }
    }
}

/// Takes voxels as bytes, gives int16.
pub(super) struct Converter {
    dtype: VoxelType,
    big_endian: bool,
    scaling: [f64; 2],
    voxels: Vec<i16>,
    /// Stored values of the narrow types; HU of the wide ones.
    narrow: Extent<i32, i128>,
    wide: Extent<f64, f64>,
    nan_count: u64,
    rounding: f64,
    infinite: Option<(usize, f64)>,
}

/// What [`Converter::finish`] gives.
pub(super) struct Converted {
    pub voxels: Vec<i16>,
    pub slope: f64,
    pub intercept: f64,
    pub stats: HuStats,
    /// Largest distance of an HU value from the whole number that stands for it.
    pub rounding: f64,
    /// Flat index and value of the first infinity.
    pub infinite: Option<(usize, f64)>,
    /// True if all HU fit into int16, or the narrow type keeps its scaling.
    pub fits: bool,
}

#[derive(Clone, Copy)]
struct Extent<T, S> {
    min: T,
    max: T,
    sum: S,
}

impl Converter {
    /// Nothing is allocated here; `scaling` is slope and intercept.
    pub(super) fn new(dtype: VoxelType, big_endian: bool, scaling: [f64; 2]) -> Self {
        Self {
            dtype,
            big_endian,
            scaling,
            voxels: Vec::new(),
            narrow: Extent { min: i32::MAX, max: i32::MIN, sum: 0 },
            wide: Extent { min: f64::INFINITY, max: f64::NEG_INFINITY, sum: 0.0 },
            nan_count: 0,
            rounding: 0.0,
            infinite: None,
        }
    }

    /// Makes room for `total` voxels; false if the machine has none.
    pub(super) fn reserve(&mut self, total: usize) -> bool {
        self.voxels.try_reserve_exact(total.saturating_sub(self.voxels.len())).is_ok()
    }

    /// Takes whole voxels.
    pub(super) fn push(&mut self, bytes: &[u8]) {
        match self.dtype {
            VoxelType::U8 => self.narrow(bytes, u8::from_le_bytes, 0),
            VoxelType::I8 => self.narrow(bytes, i8::from_le_bytes, 0),
            VoxelType::I16 => self.narrow(bytes, i16::from_le_bytes, 0),
            VoxelType::U16 => self.narrow(bytes, u16::from_le_bytes, UINT16_SHIFT),
            VoxelType::I32 => self.wide(bytes, |b| f64::from(i32::from_le_bytes(b))),
            VoxelType::U32 => self.wide(bytes, |b| f64::from(u32::from_le_bytes(b))),
            VoxelType::I64 => self.wide(bytes, |b| i64::from_le_bytes(b) as f64),
            VoxelType::U64 => self.wide(bytes, |b| u64::from_le_bytes(b) as f64),
            VoxelType::F32 => self.wide(bytes, |b| f64::from(f32::from_le_bytes(b))),
            VoxelType::F64 => self.wide(bytes, f64::from_le_bytes),
        }
    }

    fn narrow<const N: usize, T: Into<i32>>(&mut self, bytes: &[u8], decode: fn([u8; N]) -> T, shift: i32) {
        let mut extent = self.narrow;
        let mut sum = 0i64;
        let mut take = |value: T| {
            let value = value.into();
            extent.min = extent.min.min(value);
            extent.max = extent.max.max(value);
            sum += i64::from(value);
            (value - shift) as i16
        };
        let (chunks, _) = bytes.as_chunks::<N>();
        if self.big_endian {
            self.voxels.extend(chunks.iter().map(|&(mut chunk)| {
                chunk.reverse();
                take(decode(chunk))
            }));
        } else {
            self.voxels.extend(chunks.iter().map(|&chunk| take(decode(chunk))));
        }
        extent.sum += i128::from(sum);
        self.narrow = extent;
    }

    fn wide<const N: usize>(&mut self, bytes: &[u8], decode: impl Fn([u8; N]) -> f64) {
        let [slope, intercept] = self.scaling;
        for &(mut chunk) in bytes.as_chunks::<N>().0 {
            if self.big_endian {
                chunk.reverse();
            }
            let hu = slope * decode(chunk) + intercept;
            let stored = if hu.is_nan() {
                self.nan_count += 1;
                AIR_HU as i16
            } else {
                if hu.is_infinite() && self.infinite.is_none() {
                    self.infinite = Some((self.voxels.len(), hu));
                }
                self.wide.min = self.wide.min.min(hu);
                self.wide.max = self.wide.max.max(hu);
                self.wide.sum += hu;
                self.rounding = self.rounding.max((hu - hu.round()).abs());
                hu.round() as i16
            };
            self.voxels.push(stored);
        }
    }

    pub(super) fn finish(mut self) -> Converted {
        let [slope, intercept] = self.scaling;
        if self.dtype.bytes() > 2 {
            let Extent { min, max, sum } = self.wide;
            let empty = min > max;
            let range = f64::from(i16::MIN)..=f64::from(i16::MAX);
            return Converted {
                slope: 1.0,
                intercept: 0.0,
                stats: HuStats {
                    min: if empty { f64::NAN } else { min },
                    max: if empty { f64::NAN } else { max },
                    sum,
                    nan_count: self.nan_count,
                },
                rounding: self.rounding,
                infinite: self.infinite,
                fits: empty || (range.contains(&min.round()) && range.contains(&max.round())),
                voxels: self.voxels,
            };
        }
        let Extent { min, max, sum } = self.narrow;
        let [a, b] = [min, max].map(|stored| slope * f64::from(stored) + intercept);
        let stats = HuStats {
            min: a.min(b),
            max: a.max(b),
            sum: slope * sum as f64 + intercept * self.voxels.len() as f64,
            nan_count: 0,
        };
        let mut moved = 0.0;
        if self.dtype == VoxelType::U16 {
            if max > i32::from(i16::MAX) {
                moved = slope * f64::from(UINT16_SHIFT);
            } else {
                self.voxels
                    .iter_mut()
                    .for_each(|stored| *stored = (i32::from(*stored) + UINT16_SHIFT) as i16);
            }
        }
        Converted {
            voxels: self.voxels,
            slope,
            intercept: intercept + moved,
            stats,
            rounding: 0.0,
            infinite: None,
            fits: true,
        }
    }
}

/// uint16 − 32768 lies within int16.
const UINT16_SHIFT: i32 = 32768;
