//! Converts stored voxels of any real type to int16 with slope and intercept, one portion at a
//! time.
//!
//! Types of 8 and 16 bits keep their slope and intercept. If a uint16 volume has values above
//! 32767, it is stored shifted by 32768, and the intercept changes accordingly. Wider types are
//! stored as HU rounded to whole numbers, with slope 1. CT reconstructions usually hold whole HU
//! already. The largest rounding error is recorded.

use crate::{AIR_HU, HuStats};

/// A voxel type that holds one real number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum VoxelType {
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
    /// The type with this `datatype` in the header, or the name of an unsupported type.
    pub(crate) fn from_code(code: i16) -> Result<Self, &'static str> {
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

    pub(crate) fn bytes(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// The value of `datatype` in a NIfTI header.
    pub(crate) fn code(self) -> i16 {
        match self {
            Self::U8 => 2,
            Self::I16 => 4,
            Self::I32 => 8,
            Self::F32 => 16,
            Self::F64 => 64,
            Self::I8 => 256,
            Self::U16 => 512,
            Self::U32 => 768,
            Self::I64 => 1024,
            Self::U64 => 1280,
        }
    }

    /// The name of the type in an NRRD header.
    pub(crate) fn nrrd_name(self) -> &'static str {
        match self {
            Self::F32 => "float",
            Self::F64 => "double",
            integer => integer.name(),
        }
    }

    /// The name of the type in a MetaImage header.
    pub(crate) fn meta_name(self) -> &'static str {
        match self {
            Self::U8 => "MET_UCHAR",
            Self::I8 => "MET_CHAR",
            Self::I16 => "MET_SHORT",
            Self::U16 => "MET_USHORT",
            Self::I32 => "MET_INT",
            Self::U32 => "MET_UINT",
            Self::I64 => "MET_LONG_LONG",
            Self::U64 => "MET_ULONG_LONG",
            Self::F32 => "MET_FLOAT",
            Self::F64 => "MET_DOUBLE",
        }
    }

    /// The name of the type in NumPy.
    pub(crate) fn name(self) -> &'static str {
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

/// Converts voxel bytes to int16.
pub(crate) struct Converter {
    dtype: VoxelType,
    big_endian: bool,
    scaling: [f64; 2],
    voxels: Vec<i16>,
    /// Range of the stored values, for types of 8 and 16 bits.
    stored: Range<i32, i128>,
    /// Range of the HU, for wider types.
    hu: Range<f64, f64>,
    nan_count: u64,
    rounding: f64,
    infinite: Option<(usize, f64)>,
}

/// Result of a [`Converter`].
pub(crate) struct Converted {
    pub voxels: Vec<i16>,
    pub slope: f64,
    pub intercept: f64,
    pub stats: HuStats,
    /// Largest difference between an HU value and the whole number stored for it.
    pub rounding: f64,
    /// Flat index and value of the first infinity.
    pub infinite: Option<(usize, f64)>,
    /// True if all HU fit into int16, or the type keeps its slope and intercept.
    pub fits: bool,
}

#[derive(Clone, Copy)]
struct Range<T, S> {
    min: T,
    max: T,
    sum: S,
}

impl Converter {
    /// Creates a converter without allocating. `scaling` is slope and intercept.
    pub(crate) fn new(dtype: VoxelType, big_endian: bool, scaling: [f64; 2]) -> Self {
        Self {
            dtype,
            big_endian,
            scaling,
            voxels: Vec::new(),
            stored: Range { min: i32::MAX, max: i32::MIN, sum: 0 },
            hu: Range { min: f64::INFINITY, max: f64::NEG_INFINITY, sum: 0.0 },
            nan_count: 0,
            rounding: 0.0,
            infinite: None,
        }
    }

    /// Reserves memory for `total` voxels. Returns false if there is not enough.
    pub(crate) fn reserve(&mut self, total: usize) -> bool {
        self.voxels.try_reserve_exact(total.saturating_sub(self.voxels.len())).is_ok()
    }

    /// Converts and appends whole voxels.
    pub(crate) fn push(&mut self, bytes: &[u8]) {
        match self.dtype {
            VoxelType::U8 => self.push_stored(bytes, u8::from_le_bytes, 0),
            VoxelType::I8 => self.push_stored(bytes, i8::from_le_bytes, 0),
            VoxelType::I16 => self.push_stored(bytes, i16::from_le_bytes, 0),
            VoxelType::U16 => self.push_stored(bytes, u16::from_le_bytes, UINT16_SHIFT),
            VoxelType::I32 => self.push_hu(bytes, |b| f64::from(i32::from_le_bytes(b))),
            VoxelType::U32 => self.push_hu(bytes, |b| f64::from(u32::from_le_bytes(b))),
            VoxelType::I64 => self.push_hu(bytes, |b| i64::from_le_bytes(b) as f64),
            VoxelType::U64 => self.push_hu(bytes, |b| u64::from_le_bytes(b) as f64),
            VoxelType::F32 => self.push_hu(bytes, |b| f64::from(f32::from_le_bytes(b))),
            VoxelType::F64 => self.push_hu(bytes, f64::from_le_bytes),
        }
    }

    fn push_stored<const N: usize, T: Into<i32>>(
        &mut self,
        bytes: &[u8],
        decode: fn([u8; N]) -> T,
        shift: i32,
    ) {
        let mut range = self.stored;
        let mut sum = 0i64;
        let mut convert = |value: T| {
            let value = value.into();
            range.min = range.min.min(value);
            range.max = range.max.max(value);
            sum += i64::from(value);
            (value - shift) as i16
        };
        let (chunks, _) = bytes.as_chunks::<N>();
        if self.big_endian {
            self.voxels.extend(chunks.iter().map(|&(mut chunk)| {
                chunk.reverse();
                convert(decode(chunk))
            }));
        } else {
            self.voxels.extend(chunks.iter().map(|&chunk| convert(decode(chunk))));
        }
        range.sum += i128::from(sum);
        self.stored = range;
    }

    fn push_hu<const N: usize>(&mut self, bytes: &[u8], decode: impl Fn([u8; N]) -> f64) {
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
                self.hu.min = self.hu.min.min(hu);
                self.hu.max = self.hu.max.max(hu);
                self.hu.sum += hu;
                self.rounding = self.rounding.max((hu - hu.round()).abs());
                hu.round() as i16
            };
            self.voxels.push(stored);
        }
    }

    pub(crate) fn finish(mut self) -> Converted {
        let [slope, intercept] = self.scaling;
        if self.dtype.bytes() > 2 {
            let Range { min, max, sum } = self.hu;
            let empty = min > max;
            let int16 = f64::from(i16::MIN)..=f64::from(i16::MAX);
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
                fits: empty || (int16.contains(&min.round()) && int16.contains(&max.round())),
                voxels: self.voxels,
            };
        }
        let Range { min, max, sum } = self.stored;
        let [a, b] = [min, max].map(|stored| slope * f64::from(stored) + intercept);
        let stats = HuStats {
            min: a.min(b),
            max: a.max(b),
            sum: slope * sum as f64 + intercept * self.voxels.len() as f64,
            nan_count: 0,
        };
        let mut shift = 0.0;
        if self.dtype == VoxelType::U16 {
            if max > i32::from(i16::MAX) {
                shift = slope * f64::from(UINT16_SHIFT);
            } else {
                self.voxels
                    .iter_mut()
                    .for_each(|stored| *stored = (i32::from(*stored) + UINT16_SHIFT) as i16);
            }
        }
        Converted {
            voxels: self.voxels,
            slope,
            intercept: intercept + shift,
            stats,
            rounding: 0.0,
            infinite: None,
            fits: true,
        }
    }
}

/// A uint16 value minus this number fits into int16.
const UINT16_SHIFT: i32 = 32768;
