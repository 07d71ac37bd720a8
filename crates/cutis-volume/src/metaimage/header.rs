//! The fields of a MetaImage header that matter for a CT.

use std::collections::HashMap;
use std::path::Path;

use crate::voxels::{VoxelType, header_error, numbers, sizes};
use crate::{Affine, VolumeError};

/// A decoded header.
pub(super) struct Header {
    pub(super) dtype: VoxelType,
    pub(super) shape: [u64; 3],
    pub(super) affine: Affine,
    pub(super) compressed: bool,
    /// Bytes of the compressed voxels, if the header says so.
    pub(super) compressed_size: Option<u64>,
    pub(super) big_endian: bool,
    /// Name of the file with the voxels. `None` if they follow the header.
    pub(super) data_file: Option<String>,
    /// Bytes before the voxels. `None` if the voxels are at the end of the file.
    pub(super) skip: Option<u64>,
}

struct Fields<'a> {
    path: &'a Path,
    values: HashMap<&'a str, &'a str>,
}

impl<'a> Fields<'a> {
    /// The value of the first of several names for one field.
    fn get(&self, names: &[&'static str]) -> Option<&'a str> {
        names.iter().find_map(|name| self.values.get(name).copied())
    }

    fn invalid(&self, names: &[&'static str], expected: &'static str) -> VolumeError {
        let found = names.iter().find(|name| self.values.contains_key(*name)).unwrap_or(&names[0]);
        header_error(self.path, found, self.get(names).unwrap_or("missing"), expected)
    }

    fn boolean(&self, names: &[&'static str]) -> Result<Option<bool>, VolumeError> {
        match self.get(names).map(str::to_ascii_lowercase).as_deref() {
            None => Ok(None),
            Some("true" | "t" | "1") => Ok(Some(true)),
            Some("false" | "f" | "0") => Ok(Some(false)),
            Some(_) => Err(self.invalid(names, "True or False")),
        }
    }

    fn vector<const N: usize>(
        &self,
        names: &[&'static str],
        expected: &'static str,
    ) -> Result<Option<[f64; N]>, VolumeError> {
        let Some(text) = self.get(names) else { return Ok(None) };
        numbers(text).map(Some).ok_or_else(|| self.invalid(names, expected))
    }
}

const BYTE_ORDER: [&str; 2] = ["ElementByteOrderMSB", "BinaryDataByteOrderMSB"];
const MATRIX: [&str; 3] = ["TransformMatrix", "Orientation", "Rotation"];
const ORIGIN: [&str; 3] = ["Offset", "Position", "Origin"];
const SPACING: [&str; 2] = ["ElementSpacing", "ElementSize"];

impl Header {
    /// Decodes lines of the form `Name = value`.
    pub(super) fn decode(
        path: &Path,
        lines: &[String],
        warnings: &mut Vec<String>,
    ) -> Result<Self, VolumeError> {
        let pairs = lines.iter().filter_map(|line| line.split_once('='));
        let fields =
            Fields { path, values: pairs.map(|(name, value)| (name.trim(), value.trim())).collect() };
        let only = |name: &'static str, valid: fn(&str) -> bool, expected| match fields.get(&[name]) {
            Some(value) if !valid(value) => Err(fields.invalid(&[name], expected)),
            _ => Ok(()),
        };
        only("ObjectType", |value| value == "Image", "Image")?;
        only("ElementNumberOfChannels", |value| value == "1", "1")?;
        only(
            "ElementToIntensityFunctionSlope",
            |value| value.parse() == Ok(1.0),
            "1: the values must be HU",
        )?;
        only(
            "ElementToIntensityFunctionOffset",
            |value| value.parse() == Ok(0.0),
            "0: the values must be HU",
        )?;
        if fields.boolean(&["BinaryData"])? == Some(false) {
            return Err(fields.invalid(&["BinaryData"], "True"));
        }
        let shape = shape(&fields)?;
        let affine = affine(&fields)?;
        check_orientation(&fields, &affine, warnings);
        let data_file = match fields.get(&["ElementDataFile"]) {
            Some("LOCAL" | "Local" | "local") => None,
            Some(name) if is_one_file(name) => Some(name.to_owned()),
            _ => return Err(fields.invalid(&["ElementDataFile"], "LOCAL, or one file with all voxels")),
        };
        let whole = |name: &'static str| -> Result<Option<i64>, VolumeError> {
            let parse = |text: &str| text.parse().map_err(|_| fields.invalid(&[name], "a whole number"));
            fields.get(&[name]).map(parse).transpose()
        };
        let skip = match whole("HeaderSize")? {
            None => Some(0),
            Some(-1) => None,
            Some(size) => {
                Some(u64::try_from(size).map_err(|_| fields.invalid(&["HeaderSize"], "0 or more, or -1"))?)
            }
        };
        let compressed_size = match whole("CompressedDataSize")? {
            None => None,
            Some(size) => {
                Some(u64::try_from(size).map_err(|_| fields.invalid(&["CompressedDataSize"], "0 or more"))?)
            }
        };
        Ok(Self {
            dtype: dtype(&fields)?,
            shape,
            affine,
            compressed: fields.boolean(&["CompressedData"])?.unwrap_or(false),
            compressed_size,
            big_endian: fields.boolean(&BYTE_ORDER)?.unwrap_or(false),
            data_file,
            skip,
        })
    }
}

/// Whether a value of `ElementDataFile` names one file, and not a list or a pattern.
fn is_one_file(name: &str) -> bool {
    let several = name.starts_with("LIST") || name.contains('%');
    !name.is_empty() && !several && !name.chars().any(char::is_control)
}

fn dtype(fields: &Fields<'_>) -> Result<VoxelType, VolumeError> {
    Ok(match fields.get(&["ElementType"]) {
        Some("MET_CHAR") => VoxelType::I8,
        Some("MET_UCHAR") => VoxelType::U8,
        Some("MET_SHORT") => VoxelType::I16,
        Some("MET_USHORT") => VoxelType::U16,
        Some("MET_INT" | "MET_LONG") => VoxelType::I32,
        Some("MET_UINT" | "MET_ULONG") => VoxelType::U32,
        Some("MET_LONG_LONG") => VoxelType::I64,
        Some("MET_ULONG_LONG") => VoxelType::U64,
        Some("MET_FLOAT") => VoxelType::F32,
        Some("MET_DOUBLE") => VoxelType::F64,
        _ => {
            return Err(fields.invalid(&["ElementType"], "a type of one number per voxel, such as MET_SHORT"));
        }
    })
}

fn shape(fields: &Fields<'_>) -> Result<[u64; 3], VolumeError> {
    const EXPECTED: &str = "positive sizes of three axes";
    let invalid = || fields.invalid(&["DimSize"], EXPECTED);
    let all = sizes(fields.get(&["DimSize"]).unwrap_or("")).ok_or_else(invalid)?;
    let count = all.iter().skip(3).fold(1, |count: u64, &n| count.saturating_mul(n));
    if count > 1 {
        return Err(VolumeError::SeveralVolumes { path: fields.path.into(), count, dim: all });
    }
    if fields.get(&["NDims"]) != Some("3") {
        return Err(fields.invalid(&["NDims"], "3"));
    }
    all.try_into().map_err(|_| invalid())
}

/// The matrix holds the direction of one voxel axis after the other, in LPS.
fn affine(fields: &Fields<'_>) -> Result<Affine, VolumeError> {
    let spacing = fields.vector::<3>(&SPACING, "three positive distances in mm")?.unwrap_or([1.0; 3]);
    if spacing.iter().any(|&size| size <= 0.0) {
        return Err(fields.invalid(&SPACING, "three positive distances in mm"));
    }
    let identity = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let matrix = fields.vector::<9>(&MATRIX, "three directions, nine numbers")?.unwrap_or(identity);
    let origin =
        fields.vector::<3>(&ORIGIN, "the position of the first voxel, three numbers")?.unwrap_or([0.0; 3]);
    let sign = [-1.0, -1.0, 1.0];
    let line = |r: usize| -> [f64; 4] {
        std::array::from_fn(|c| sign[r] * if c < 3 { matrix[3 * c + r] * spacing[c] } else { origin[r] })
    };
    Affine::from_rows([line(0), line(1), line(2), [0.0, 0.0, 0.0, 1.0]])
        .map_err(|_| fields.invalid(&MATRIX, "directions that map voxels to distinct positions"))
}

/// `AnatomicalOrientation` names the side from which each axis starts: `RAI` is our `LPS`.
fn check_orientation(fields: &Fields<'_>, affine: &Affine, warnings: &mut Vec<String>) {
    let Some(given) = fields.get(&["AnatomicalOrientation"]).filter(|text| !text.contains('?')) else {
        return;
    };
    let from = |to: char| match to {
        'R' => 'L',
        'L' => 'R',
        'A' => 'P',
        'P' => 'A',
        'S' => 'I',
        _ => 'S',
    };
    let ours: String = affine.orientation().map(from).iter().collect();
    if !given.eq_ignore_ascii_case(&ours) {
        let given: String = given.chars().filter(|c| c.is_ascii_alphabetic()).take(8).collect();
        warnings.push(format!(
            "AnatomicalOrientation is {given}, but the directions of the axes are {ours}: the directions are used, as ITK does"
        ));
    }
}
