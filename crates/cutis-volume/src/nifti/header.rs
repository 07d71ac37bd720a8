//! Decodes and checks the fields of a NIfTI-1 or NIfTI-2 header that matter for a CT.

use std::path::Path;

use crate::VolumeError;

/// Length of a NIfTI-1 header in bytes.
pub(super) const NIFTI1: usize = 348;
/// Length of a NIfTI-2 header in bytes.
pub(super) const NIFTI2: usize = 540;

/// Header fields, in one form for both versions and byte orders.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Header {
    pub big_endian: bool,
    /// False if the voxels are in a separate `.img` file.
    pub single_file: bool,
    /// Voxels along the three spatial axes. A missing axis counts as 1.
    pub shape: [u64; 3],
    pub datatype: i16,
    /// Byte offset of the first voxel in its file.
    pub voxel_offset: u64,
    /// `scl_slope` and `scl_inter`, unchecked.
    pub scaling: [f64; 2],
    /// `xyzt_units`.
    pub units: u8,
    pub pixdim: [f64; 4],
    pub qform_code: i32,
    pub sform_code: i32,
    /// `quatern_b`, `quatern_c`, `quatern_d`.
    pub quaternion: [f64; 3],
    /// `qoffset_x`, `qoffset_y`, `qoffset_z`.
    pub offset: [f64; 3],
    /// `srow_x`, `srow_y`, `srow_z`.
    pub rows: [[f64; 4]; 3],
}

impl Header {
    /// Length of the header that begins with the bytes `first`.
    ///
    /// # Errors
    /// [`VolumeError::NotNifti`] if no NIfTI header begins with them.
    pub(super) fn len(path: &Path, first: [u8; 4]) -> Result<usize, VolumeError> {
        match [u32::from_le_bytes(first), u32::from_be_bytes(first)] {
            [348, _] | [_, 348] => Ok(NIFTI1),
            [540, _] | [_, 540] => Ok(NIFTI2),
            _ => Err(VolumeError::NotNifti {
                path: path.into(),
                reason: "its first four bytes are neither 348 (NIfTI-1) nor 540 (NIfTI-2); it is neither NRRD, nor \
                         MetaImage, nor DICOM either",
            }),
        }
    }

    /// Decodes a header of [`NIFTI1`] or [`NIFTI2`] bytes.
    ///
    /// # Errors
    /// [`VolumeError::NotNifti`], [`VolumeError::Header`], [`VolumeError::SeveralVolumes`].
    pub(super) fn decode(path: &Path, bytes: &[u8]) -> Result<Self, VolumeError> {
        let version_2 = bytes.len() == NIFTI2;
        let big_endian = bytes[0] == 0;
        let f = Fields { bytes, big_endian };
        let magic = if version_2 { &bytes[4..8] } else { &bytes[344..348] };
        let single_file = match (magic, version_2) {
            (b"n+1\0", false) | (b"n+2\0", true) => true,
            (b"ni1\0", false) | (b"ni2\0", true) => false,
            _ => {
                return Err(VolumeError::NotNifti {
                    path: path.into(),
                    reason: "the magic n+1, ni1, n+2 or ni2 is missing (an Analyze 7.5 file holds no orientation)",
                });
            }
        };
        let (dim, voxel_offset): ([i64; 8], f64) = if version_2 {
            (std::array::from_fn(|i| f.i64(16 + 8 * i)), f.i64(168) as f64)
        } else {
            (std::array::from_fn(|i| i64::from(f.i16(40 + 2 * i))), f.f32(108))
        };
        let shape = shape(path, dim)?;
        let least = if single_file { bytes.len() } else { 0 };
        if voxel_offset.fract() != 0.0 || !(least as f64..=9.0e15).contains(&voxel_offset) {
            return Err(VolumeError::Header {
                path: path.into(),
                field: "vox_offset",
                value: voxel_offset.to_string(),
                expected: match (single_file, version_2) {
                    (false, _) => "a whole number from 0",
                    (true, false) => "a whole number from 348",
                    (true, true) => "a whole number from 540",
                },
            });
        }
        let voxel_offset = voxel_offset as u64;
        Ok(if version_2 {
            Self {
                big_endian,
                single_file,
                shape,
                datatype: f.i16(12),
                voxel_offset,
                scaling: [f.f64(176), f.f64(184)],
                units: (f.i32(500) & 0xff) as u8,
                pixdim: std::array::from_fn(|i| f.f64(104 + 8 * i)),
                qform_code: f.i32(344),
                sform_code: f.i32(348),
                quaternion: std::array::from_fn(|i| f.f64(352 + 8 * i)),
                offset: std::array::from_fn(|i| f.f64(376 + 8 * i)),
                rows: std::array::from_fn(|r| std::array::from_fn(|c| f.f64(400 + 32 * r + 8 * c))),
            }
        } else {
            Self {
                big_endian,
                single_file,
                shape,
                datatype: f.i16(70),
                voxel_offset,
                scaling: [f.f32(112), f.f32(116)],
                units: bytes[123],
                pixdim: std::array::from_fn(|i| f.f32(76 + 4 * i)),
                qform_code: f.i16(252).into(),
                sform_code: f.i16(254).into(),
                quaternion: std::array::from_fn(|i| f.f32(256 + 4 * i)),
                offset: std::array::from_fn(|i| f.f32(268 + 4 * i)),
                rows: std::array::from_fn(|r| std::array::from_fn(|c| f.f32(280 + 16 * r + 4 * c))),
            }
        })
    }
}

fn shape(path: &Path, dim: [i64; 8]) -> Result<[u64; 3], VolumeError> {
    const FIELDS: [&str; 8] =
        ["dim[0]", "dim[1]", "dim[2]", "dim[3]", "dim[4]", "dim[5]", "dim[6]", "dim[7]"];
    let wrong = |i: usize, expected| {
        Err(VolumeError::Header { path: path.into(), field: FIELDS[i], value: dim[i].to_string(), expected })
    };
    if !(1..=7).contains(&dim[0]) {
        return wrong(0, "the number of axes, 1 to 7");
    }
    let axes = dim[0] as usize;
    if let Some(i) = (1..=axes).find(|&i| dim[i] < 1) {
        return wrong(i, "at least 1 voxel");
    }
    let used: Vec<u64> = dim[1..=axes].iter().map(|&n| n as u64).collect();
    let count = used.iter().skip(3).fold(1u64, |count, &n| count.saturating_mul(n));
    if count != 1 {
        return Err(VolumeError::SeveralVolumes { path: path.into(), count, dim: used });
    }
    Ok(std::array::from_fn(|axis| used.get(axis).copied().unwrap_or(1)))
}

/// Reads numbers at byte offsets. All offsets used here are within the header.
struct Fields<'a> {
    bytes: &'a [u8],
    big_endian: bool,
}

impl Fields<'_> {
    fn take<const N: usize>(&self, at: usize) -> [u8; N] {
        let mut field: [u8; N] = std::array::from_fn(|i| self.bytes[at + i]);
        if self.big_endian {
            field.reverse();
        }
        field
    }

    fn i16(&self, at: usize) -> i16 {
        i16::from_le_bytes(self.take(at))
    }

    fn i32(&self, at: usize) -> i32 {
        i32::from_le_bytes(self.take(at))
    }

    fn i64(&self, at: usize) -> i64 {
        i64::from_le_bytes(self.take(at))
    }

    fn f32(&self, at: usize) -> f64 {
        f32::from_le_bytes(self.take(at)).into()
    }

    fn f64(&self, at: usize) -> f64 {
        f64::from_le_bytes(self.take(at))
    }
}
