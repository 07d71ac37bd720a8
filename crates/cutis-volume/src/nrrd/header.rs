//! The fields of an NRRD header that matter for a CT.

use std::collections::HashMap;
use std::path::Path;

use crate::voxels::{VoxelType, header_error, numbers, sizes};
use crate::{Affine, VolumeError};

/// How the voxels are compressed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Encoding {
    Raw,
    Gzip,
}

/// A decoded header.
pub(super) struct Header {
    pub(super) dtype: VoxelType,
    pub(super) shape: [u64; 3],
    pub(super) affine: Affine,
    pub(super) encoding: Encoding,
    pub(super) big_endian: bool,
    /// Name of the file with the voxels. `None` if they follow the header.
    pub(super) data_file: Option<String>,
    /// Bytes before the voxels. `None` if the voxels are at the end of the file.
    pub(super) skip: Option<u64>,
}

/// The fields of a header, by their name in small letters without spaces.
struct Fields<'a> {
    path: &'a Path,
    values: HashMap<String, String>,
}

impl Fields<'_> {
    fn get(&self, name: &'static str) -> Option<&str> {
        self.values.get(&name.replace(' ', "")).map(String::as_str)
    }

    fn required(&self, name: &'static str, expected: &'static str) -> Result<&str, VolumeError> {
        self.get(name).ok_or_else(|| header_error(self.path, name, "missing", expected))
    }

    fn invalid(&self, name: &'static str, expected: &'static str) -> VolumeError {
        header_error(self.path, name, self.get(name).unwrap_or("missing"), expected)
    }
}

impl Header {
    /// Decodes the lines after the magic.
    pub(super) fn decode(
        path: &Path,
        lines: &[String],
        warnings: &mut Vec<String>,
    ) -> Result<Self, VolumeError> {
        let mut fields = Fields { path, values: HashMap::new() };
        for line in lines.iter().filter(|line| !line.starts_with('#') && !line.contains(":=")) {
            if let Some((name, value)) = line.split_once(": ").or_else(|| line.split_once(':')) {
                fields.values.insert(name.to_ascii_lowercase().replace(' ', ""), value.trim().to_owned());
            }
        }
        let dtype = dtype(&fields)?;
        let encoding = match fields.required("encoding", "raw or gzip")? {
            "raw" => Encoding::Raw,
            "gzip" | "gz" => Encoding::Gzip,
            _ => return Err(fields.invalid("encoding", "raw or gzip")),
        };
        let big_endian = match fields.get("endian") {
            Some("little") => false,
            Some("big") => true,
            None if dtype.bytes() == 1 => false,
            _ => return Err(fields.invalid("endian", "little or big")),
        };
        let (shape, axes) = shape(&fields)?;
        let affine = affine(&fields, &axes, warnings)?;
        let data_file = fields.get("data file").or(fields.get("datafile")).map(str::to_owned);
        let several = |name: &str| name.starts_with("LIST") || name.contains('%');
        if data_file.as_deref().is_some_and(|name| several(name) || name.chars().any(char::is_control)) {
            return Err(fields.invalid("data file", "one file with all voxels"));
        }
        if fields.get("line skip").is_some_and(|skip| skip != "0") {
            return Err(fields.invalid("line skip", "0"));
        }
        let skip = match fields.get("byte skip").map(str::parse) {
            None => Some(0),
            Some(Ok(-1)) if encoding == Encoding::Raw => None,
            Some(Ok(skip)) => Some(
                u64::try_from(skip)
                    .map_err(|_| fields.invalid("byte skip", "0 or more, or -1 for raw voxels"))?,
            ),
            Some(Err(_)) => return Err(fields.invalid("byte skip", "a whole number")),
        };
        Ok(Self { dtype, shape, affine, encoding, big_endian, data_file, skip })
    }
}

fn dtype(fields: &Fields<'_>) -> Result<VoxelType, VolumeError> {
    const EXPECTED: &str = "an integer of 8 to 64 bits, float or double";
    let words: Vec<&str> = fields.required("type", EXPECTED)?.split_whitespace().collect();
    let (signed, words) = match &words[..] {
        ["unsigned", rest @ ..] => (false, rest.join(" ")),
        ["signed", rest @ ..] => (true, rest.join(" ")),
        all => {
            let name = all.join(" ");
            let bare = name.strip_prefix('u').map(str::to_owned);
            (bare.is_none(), bare.unwrap_or(name))
        }
    };
    Ok(match (words.as_str(), signed) {
        ("char" | "int8" | "int8_t", true) => VoxelType::I8,
        ("char" | "int8" | "int8_t", false) => VoxelType::U8,
        ("short" | "short int" | "int16" | "int16_t", true) => VoxelType::I16,
        ("short" | "short int" | "int16" | "int16_t", false) => VoxelType::U16,
        ("int" | "int32" | "int32_t", true) => VoxelType::I32,
        ("int" | "int32" | "int32_t", false) => VoxelType::U32,
        ("longlong" | "long long" | "long long int" | "int64" | "int64_t", true) => VoxelType::I64,
        ("longlong" | "long long" | "long long int" | "int64" | "int64_t", false) => VoxelType::U64,
        ("float", true) => VoxelType::F32,
        ("double", true) => VoxelType::F64,
        _ => return Err(fields.invalid("type", EXPECTED)),
    })
}

/// A step between voxels, or `none` for an axis that is not one of space.
type Direction = Option<[f64; 3]>;

/// Sizes of the three axes of space, and the number of each of them among all axes.
fn shape(fields: &Fields<'_>) -> Result<([u64; 3], Vec<usize>), VolumeError> {
    const EXPECTED: &str = "positive sizes of three axes, and more axes of size 1";
    let all = sizes(fields.required("sizes", EXPECTED)?).ok_or_else(|| fields.invalid("sizes", EXPECTED))?;
    let spatial = match directions(fields)? {
        Some(directions) if directions.len() == all.len() => {
            (0..all.len()).filter(|&axis| directions[axis].is_some()).collect()
        }
        Some(_) => return Err(fields.invalid("space directions", "one vector, or none, for each axis")),
        // Without directions the axes of more than one voxel are those of space.
        None if all.len() == 3 => vec![0, 1, 2],
        None => (0..all.len()).filter(|&axis| all[axis] > 1).collect::<Vec<usize>>(),
    };
    let count: u64 = (0..all.len())
        .filter(|axis| !spatial.contains(axis))
        .map(|axis| all[axis])
        .fold(1, u64::saturating_mul);
    if count > 1 {
        return Err(VolumeError::SeveralVolumes { path: fields.path.into(), count, dim: all });
    }
    match spatial[..] {
        [a, b, c] => Ok(([all[a], all[b], all[c]], spatial)),
        _ => Err(fields.invalid("sizes", EXPECTED)),
    }
}

/// The vectors of `space directions`, for each axis of the file.
fn directions(fields: &Fields<'_>) -> Result<Option<Vec<Direction>>, VolumeError> {
    let Some(text) = fields.get("space directions") else { return Ok(None) };
    let invalid = || fields.invalid("space directions", "vectors (x,y,z), or none");
    let (mut directions, mut rest) = (Vec::new(), text.trim());
    while !rest.is_empty() {
        if let Some(after) = rest.strip_prefix("none") {
            directions.push(None);
            rest = after.trim_start();
        } else {
            let (vector, after) = rest.split_once(')').ok_or_else(invalid)?;
            directions.push(Some(vector_of(vector).ok_or_else(invalid)?));
            rest = after.trim_start();
        }
    }
    Ok(Some(directions))
}

/// The numbers of a vector such as `(1,0,0)`, with or without the last bracket.
fn vector_of(text: &str) -> Option<[f64; 3]> {
    let inner = text.trim().strip_prefix('(')?.trim_end_matches(')');
    numbers(&inner.replace(',', " "))
}

fn affine(fields: &Fields<'_>, axes: &[usize], warnings: &mut Vec<String>) -> Result<Affine, VolumeError> {
    const SPACES: &str = "left-posterior-superior, right-anterior-superior or left-anterior-superior";
    let space = fields.get("space").map(str::to_ascii_lowercase);
    // Signs that turn the coordinates of the file into RAS.
    let sign = match space.as_deref() {
        Some("left-posterior-superior" | "lps") => [-1.0, -1.0, 1.0],
        Some("right-anterior-superior" | "ras") => [1.0, 1.0, 1.0],
        Some("left-anterior-superior" | "las") => [-1.0, 1.0, 1.0],
        Some(_) => return Err(fields.invalid("space", SPACES)),
        None => {
            warnings.push(
                "the header has no space, so orientation is unknown: its axes are taken as left, posterior and superior, as \
                 ITK does"
                    .into(),
            );
            [-1.0, -1.0, 1.0]
        }
    };
    let scale = units(fields)?;
    let steps: Vec<[f64; 3]> = match directions(fields)? {
        Some(directions) => axes.iter().filter_map(|&axis| directions[axis]).collect(),
        None => spacings(fields, axes)?,
    };
    let origin = match fields.get("space origin") {
        Some(text) => vector_of(text)
            .ok_or_else(|| fields.invalid("space origin", "the vector (x,y,z) of the first voxel"))?,
        None if fields.get("axis mins").is_some() => {
            return Err(fields.invalid("axis mins", "space origin instead"));
        }
        None => [0.0; 3],
    };
    let line = |r: usize| -> [f64; 4] {
        std::array::from_fn(|c| sign[r] * scale * if c < 3 { steps[c][r] } else { origin[r] })
    };
    Affine::from_rows([line(0), line(1), line(2), [0.0, 0.0, 0.0, 1.0]])
        .map_err(|_| fields.invalid("space directions", "vectors that map voxels to distinct positions"))
}

/// Steps along the axes of space from `spacings`.
fn spacings(fields: &Fields<'_>, axes: &[usize]) -> Result<Vec<[f64; 3]>, VolumeError> {
    const EXPECTED: &str = "space directions, or one positive distance for each axis";
    let parts: Vec<&str> = fields.required("spacings", EXPECTED)?.split_whitespace().collect();
    let step = |(n, &axis): (usize, &usize)| {
        let size: f64 = parts.get(axis)?.parse().ok().filter(|&size: &f64| size > 0.0 && size.is_finite())?;
        Some(std::array::from_fn(|world| if world == n { size } else { 0.0 }))
    };
    let steps: Option<Vec<[f64; 3]>> = axes.iter().enumerate().map(step).collect();
    steps.ok_or_else(|| fields.invalid("spacings", EXPECTED))
}

/// Millimeters per unit of space.
fn units(fields: &Fields<'_>) -> Result<f64, VolumeError> {
    let Some(text) = fields.get("space units") else { return Ok(1.0) };
    let names: Vec<&str> = text.split_whitespace().map(|name| name.trim_matches('"')).collect();
    match names.first() {
        Some(first) if names.iter().any(|name| name != first) => {
            Err(fields.invalid("space units", "one unit for all axes"))
        }
        None | Some(&("mm" | "" | "???")) => Ok(1.0),
        Some(&"cm") => Ok(10.0),
        Some(&"m") => Ok(1000.0),
        Some(&("um" | "µm" | "microns")) => Ok(0.001),
        Some(_) => Err(fields.invalid("space units", "mm, cm, m or um")),
    }
}
