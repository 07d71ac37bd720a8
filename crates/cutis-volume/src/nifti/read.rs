//! Reads a CT volume from a `.nii` or `.nii.gz` file or a `.hdr`/`.img` pair.

use std::path::{Path, PathBuf};

use super::header::Header;
use super::placement;
use crate::voxels::{Layout, Observer, Opened, Source, VoxelType, again, decode};
use crate::{Loaded, VolumeError};

/// Reads a NIfTI-1 or NIfTI-2 file in either byte order, compressed or not, with integer or real
/// voxels.
///
/// The position comes from the sform if its code is above 0, else from the qform, else from the
/// voxel sizes. Meters and micrometers become millimeters. With a slope of 0 or NaN the stored
/// values are the HU. Voxel types above 16 bits are rounded to whole HU. The memory use is little
/// more than the int16 voxels.
///
/// # Errors
/// [`VolumeError::Io`], [`VolumeError::MissingPartner`], [`VolumeError::NotNifti`],
/// [`VolumeError::Header`], [`VolumeError::VoxelType`] for color and complex voxels,
/// [`VolumeError::SeveralVolumes`], [`VolumeError::Truncated`], [`VolumeError::TooLarge`],
/// [`VolumeError::Range`] or [`VolumeError::Infinite`]. Each names the file.
pub fn read(path: impl AsRef<Path>) -> Result<Loaded, VolumeError> {
    read_files(path.as_ref(), None)
}

/// Reads a volume as [`read`] does, and passes the raw bytes of its files to `observe` on the way.
///
/// Use it to hash a file without reading it twice. `observe` receives the path of the file and the
/// next portion of its bytes as they are on the disk, before decompression. When the function
/// succeeds, it has received every byte of the file, in order, including bytes after the last
/// voxel. Of a pair it receives first the whole `.hdr` file and then the whole `.img` file. One of
/// the two paths is exactly `path`.
///
/// ```
/// # use cutis_volume::{nifti, phantom};
/// # let folder = std::env::temp_dir().join(format!("cutis-observed-{}", std::process::id()));
/// # std::fs::create_dir_all(&folder).unwrap();
/// let path = folder.join("ball.nii.gz");
/// nifti::write(&path, &phantom::sphere([20; 3], [1.0; 3], 8.0, 40)?)?;
/// let mut size = 0;
/// nifti::read_observed(&path, |_file, bytes| size += bytes.len() as u64)?;
/// assert_eq!(size, std::fs::metadata(&path).unwrap().len());
/// # std::fs::remove_dir_all(&folder).unwrap();
/// # Ok::<(), cutis_volume::VolumeError>(())
/// ```
///
/// # Errors
/// The errors of [`read`]. After an error `observe` may have received only a part of the bytes.
pub fn read_observed(
    path: impl AsRef<Path>,
    mut observe: impl FnMut(&Path, &[u8]),
) -> Result<Loaded, VolumeError> {
    read_files(path.as_ref(), Some(&mut observe))
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
    if path.is_dir() {
        let reason = "it is a folder: a DICOM series is read by builds with the feature dicom, and dcm2niix converts it to one file";
        return Err(VolumeError::NotNifti { path: path.into(), reason });
    }
    let pair = pair(path)?;
    let header_path = pair.as_ref().map_or(path, |(header, _)| header);
    let mut source = Source::open(header_path, again(&mut observer))?;
    let header = header(&mut source)?;
    match &pair {
        None if !header.single_file => {
            return Err(wrong_magic(header_path, "n+1 or n+2 (voxels in the same file)"));
        }
        Some(_) if header.single_file => {
            return Err(wrong_magic(header_path, "ni1 or ni2 (voxels in the .img file)"));
        }
        None => {}
        Some((_, image)) => {
            source.finish()?;
            source = Source::open(image, again(&mut observer))?;
        }
    }
    read(opened(source, header_path, &header)?)
}

/// Reads the header at the beginning of a file.
fn header(source: &mut Source<'_>) -> Result<Header, VolumeError> {
    let mut bytes = vec![0; 4];
    let reason = "it is shorter than a header";
    let short = VolumeError::NotNifti { path: source.path.clone(), reason };
    if source.fill(&mut bytes)? < 4 {
        return Err(short);
    }
    let len = Header::len(&source.path, [bytes[0], bytes[1], bytes[2], bytes[3]])?;
    bytes.resize(len, 0);
    if source.fill(&mut bytes[4..])? < len - 4 {
        return Err(short);
    }
    Header::decode(&source.path, &bytes)
}

fn opened<'a>(source: Source<'a>, header_path: &Path, header: &Header) -> Result<Opened<'a>, VolumeError> {
    let mut warnings = Vec::new();
    let dtype = VoxelType::from_code(header.datatype).map_err(|dtype| VolumeError::VoxelType {
        path: header_path.into(),
        dtype,
        code: header.datatype,
    })?;
    let affine = placement::affine(header_path, header, &mut warnings)?;
    let scaling = scaling(header_path, header, &mut warnings)?;

    let layout = Layout {
        shape: header.shape,
        affine,
        dtype,
        big_endian: header.big_endian,
        scaling,
        offset: header.voxel_offset,
    };
    Ok(Opened { source, layout, warnings, segments: Vec::new() })
}

/// Paths of the header and image file of a pair, given either of them. `None` for a single file.
fn pair(path: &Path) -> Result<Option<(PathBuf, PathBuf)>, VolumeError> {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let lower = name.to_ascii_lowercase();
    let stem_end = lower.strip_suffix(".gz").unwrap_or(&lower).len();
    let is_header = lower[..stem_end].ends_with(".hdr");
    if !is_header && !lower[..stem_end].ends_with(".img") {
        return Ok(None);
    }
    let stem = &name[..stem_end - 4];
    let other = match (is_header, name[..stem_end].ends_with(char::is_uppercase)) {
        (true, false) => "img",
        (true, true) => "IMG",
        (false, false) => "hdr",
        (false, true) => "HDR",
    };
    let candidates = ["", ".gz"].map(|gz| path.with_file_name(format!("{stem}.{other}{gz}")));
    match candidates.iter().find(|candidate| candidate.is_file()) {
        Some(partner) if is_header => Ok(Some((path.into(), partner.clone()))),
        Some(partner) => Ok(Some((partner.clone(), path.into()))),
        // If the given file itself is missing, opening it reports that.
        None if !path.exists() => Ok(None),
        None => Err(VolumeError::MissingPartner { path: path.into(), partner: candidates[0].clone() }),
    }
}

fn wrong_magic(path: &Path, expected: &'static str) -> VolumeError {
    VolumeError::Header {
        path: path.into(),
        field: "magic",
        value: "of the other kind of file".into(),
        expected,
    }
}

/// Slope and intercept. They are 1 and 0 if the header has no scaling.
fn scaling(path: &Path, header: &Header, warnings: &mut Vec<String>) -> Result<[f64; 2], VolumeError> {
    let [slope, intercept] = header.scaling;
    if slope == 0.0 || !slope.is_finite() {
        if intercept != 0.0 && intercept.is_finite() {
            warnings.push(format!(
                "scl_slope is {slope}: voxels are not scaled, and scl_inter {intercept} is ignored"
            ));
        }
        return Ok([1.0, 0.0]);
    }
    for (field, value) in [("scl_slope", slope), ("scl_inter", intercept)] {
        // A volume holds them as f32, but NIfTI-2 as f64.
        if !(value as f32).is_finite() || (value != 0.0 && value as f32 == 0.0) {
            let expected = "a number within the range of f32";
            return Err(VolumeError::Header { path: path.into(), field, value: value.to_string(), expected });
        }
    }
    Ok([slope, intercept])
}
