//! NIfTI in: one CT volume from a `.nii`, `.nii.gz` or `.hdr`/`.img` pair.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

use flate2::bufread::MultiGzDecoder;

use super::convert::{Converter, VoxelType};
use super::header::Header;
use super::placement;
use crate::{Grid, Volume, VolumeError};

/// Bytes decoded at a time; a multiple of every voxel size.
const PORTION: usize = 1 << 18;
/// Deflate cannot expand a byte to more than this (a match of 258 bytes takes at least two bits).
const DEFLATE_LIMIT: u64 = 1032;
/// Bytes looked at after the last voxel, to reach the gzip checksum.
const TAIL: u64 = 1 << 16;

/// A volume as read, and what its file said.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The voxels, where they lie, and their scaling to HU.
    pub volume: Volume,
    /// Figures of the HU in the file, before any conversion.
    pub stats: HuStats,
    /// Type of the voxels in the file, by numpy's name: `int16`, `float32`, …
    pub dtype: &'static str,
    /// What was unusual and how it was taken.
    pub warnings: Vec<String>,
}

/// Figures of all voxels that are not NaN.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HuStats {
    /// Lowest value, HU; NaN if every voxel is.
    pub min: f64,
    /// Highest value, HU; NaN if every voxel is.
    pub max: f64,
    /// Sum, HU.
    pub sum: f64,
    /// Voxels that are NaN; they become air (−1024 HU).
    pub nan_count: u64,
}

/// Reads NIfTI-1 or NIfTI-2, either byte order, compressed or not, with any integer or real voxel type.
///
/// Position: sform if its code is above 0, else qform, else voxel sizes; metres and micrometres become millimetres. A slope of 0
/// or NaN means unscaled. Memory: the int16 voxels and little else. Types above 16 bits are rounded to whole HU.
///
/// # Errors
/// Each names the file: [`VolumeError::Io`], [`VolumeError::MissingPartner`], [`VolumeError::NotNifti`],
/// [`VolumeError::Header`], [`VolumeError::VoxelType`] for colour and complex voxels, [`VolumeError::SeveralVolumes`],
/// [`VolumeError::Truncated`], [`VolumeError::TooLarge`], [`VolumeError::Range`], [`VolumeError::Infinite`].
pub fn read(path: impl AsRef<Path>) -> Result<Loaded, VolumeError> {
    let path = path.as_ref();
    let pair = pair(path)?;
    let header_path = pair.as_ref().map_or(path, |(header, _)| header);
    let mut source = Source::open(header_path)?;
    let header = source.header()?;
    match &pair {
        None if !header.single_file => {
            return Err(wrong_magic(header_path, "n+1 or n+2 (voxels in the same file)"));
        }
        Some(_) if header.single_file => {
            return Err(wrong_magic(header_path, "ni1 or ni2 (voxels in the .img file)"));
        }
        None => {}
        Some((_, image)) => source = Source::open(image)?,
    }
    load(source, &header)
}

fn load(mut source: Source, header: &Header) -> Result<Loaded, VolumeError> {
    let path = source.path.clone();
    let mut warnings = Vec::new();
    let dtype = VoxelType::from_code(header.datatype).map_err(|dtype| VolumeError::VoxelType {
        path: path.clone(),
        dtype,
        code: header.datatype,
    })?;
    let affine = placement::affine(&path, header, &mut warnings)?;
    let scaling = scaling(&path, header, &mut warnings)?;

    let too_large = || VolumeError::TooLarge { path: path.clone(), shape: header.shape };
    let count = header.shape.iter().try_fold(1u64, |count, &n| count.checked_mul(n)).ok_or_else(too_large)?;
    let bytes = count.checked_mul(dtype.bytes() as u64).ok_or_else(too_large)?;
    let voxels = usize::try_from(count).map_err(|_| too_large())?;
    source.expect(header.voxel_offset, bytes)?;
    source.skip_to(header.voxel_offset, bytes)?;

    let mut converter = Converter::new(dtype, header.big_endian, scaling);
    let mut reserved = 0usize;
    let mut buffer = vec![0; PORTION.min(bytes as usize)];
    let mut done = 0u64;
    while done < bytes {
        let wanted = PORTION.min((bytes - done) as usize);
        let got = source.fill(&mut buffer[..wanted])?;
        done += got as u64;
        if got < wanted {
            return Err(VolumeError::Truncated { path, expected_bytes: bytes, found_bytes: done });
        }
        let taken = (done / dtype.bytes() as u64) as usize;
        if taken > reserved {
            // An uncompressed file has shown its length; a compressed one earns room as it delivers.
            let room =
                if source.compressed { (4 * taken).max(source.len as usize).min(voxels) } else { voxels };
            if !converter.reserve(room - (taken - wanted / dtype.bytes())) {
                return Err(too_large());
            }
            reserved = room;
        }
        converter.push(&buffer[..wanted]);
    }
    source.check_tail(&mut warnings)?;

    let shape = header.shape.map(|n| n as usize);
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
        warnings.push(format!("{} voxels are NaN: taken as air (-1024 HU)", stats.nan_count));
    }
    let volume = Volume::new(
        Grid { shape, affine },
        converted.voxels,
        converted.slope as f32,
        converted.intercept as f32,
    )?;
    Ok(Loaded { volume, stats, dtype: dtype.name(), warnings })
}

/// Header and image of a pair, from the name of either; none for a single file.
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
        // A file that is not there at all is reported as such by the attempt to open it.
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

/// Slope and intercept, 1 and 0 where the header does not scale.
fn scaling(path: &Path, header: &Header, warnings: &mut Vec<String>) -> Result<[f64; 2], VolumeError> {
    let [slope, intercept] = header.scaling;
    if slope == 0.0 || !slope.is_finite() {
        if intercept != 0.0 && intercept.is_finite() {
            warnings.push(format!(
                "scl_slope is {slope}: voxels are taken unscaled, scl_inter {intercept} is ignored"
            ));
        }
        return Ok([1.0, 0.0]);
    }
    for (field, value) in [("scl_slope", slope), ("scl_inter", intercept)] {
        // A volume keeps them in f32; NIfTI-2 could hold more.
        if !(value as f32).is_finite() || (value != 0.0 && value as f32 == 0.0) {
            let expected = "a number within the range of f32";
            return Err(VolumeError::Header { path: path.into(), field, value: value.to_string(), expected });
        }
    }
    Ok([slope, intercept])
}

/// An open file, decompressed where its first bytes say gzip.
struct Source {
    path: PathBuf,
    reader: Box<dyn Read>,
    compressed: bool,
    /// Bytes on the disk.
    len: u64,
    /// Bytes delivered so far.
    at: u64,
}

impl Source {
    fn open(path: &Path) -> Result<Self, VolumeError> {
        let failed = |source| VolumeError::Io { path: path.into(), action: "read", source };
        let mut file = File::open(path).map_err(failed)?;
        let len = file.metadata().map_err(failed)?.len();
        let mut magic = Vec::with_capacity(2);
        file.by_ref().take(2).read_to_end(&mut magic).map_err(failed)?;
        let compressed = magic == [0x1f, 0x8b];
        let whole = BufReader::with_capacity(PORTION, io::Cursor::new(magic).chain(file));
        let reader: Box<dyn Read> =
            if compressed { Box::new(MultiGzDecoder::new(whole)) } else { Box::new(whole) };
        Ok(Self { path: path.into(), reader, compressed, len, at: 0 })
    }

    fn header(&mut self) -> Result<Header, VolumeError> {
        let mut bytes = vec![0; 4];
        let short =
            || VolumeError::NotNifti { path: self.path.clone(), reason: "it is shorter than a header" };
        let short = short();
        if self.fill(&mut bytes)? < 4 {
            return Err(short);
        }
        let len = Header::len(&self.path, [bytes[0], bytes[1], bytes[2], bytes[3]])?;
        bytes.resize(len, 0);
        if self.fill(&mut bytes[4..])? < len - 4 {
            return Err(short);
        }
        Header::decode(&self.path, &bytes)
    }

    /// Refuses at once what the length on the disk cannot hold.
    fn expect(&self, voxel_offset: u64, bytes: u64) -> Result<(), VolumeError> {
        let most = if self.compressed { self.len.saturating_mul(DEFLATE_LIMIT) } else { self.len };
        match voxel_offset.checked_add(bytes) {
            Some(end) if end <= most => Ok(()),
            _ => Err(VolumeError::Truncated {
                path: self.path.clone(),
                expected_bytes: bytes,
                found_bytes: most.saturating_sub(voxel_offset),
            }),
        }
    }

    fn skip_to(&mut self, voxel_offset: u64, bytes: u64) -> Result<(), VolumeError> {
        let mut rest = vec![0; PORTION];
        while self.at < voxel_offset {
            let wanted = PORTION.min((voxel_offset - self.at) as usize);
            if self.fill(&mut rest[..wanted])? < wanted {
                return Err(VolumeError::Truncated {
                    path: self.path.clone(),
                    expected_bytes: bytes,
                    found_bytes: 0,
                });
            }
        }
        Ok(())
    }

    /// Fills the buffer, or as much of it as the file still has.
    fn fill(&mut self, buffer: &mut [u8]) -> Result<usize, VolumeError> {
        let mut filled = 0;
        while filled < buffer.len() {
            match self.reader.read(&mut buffer[filled..]) {
                Ok(0) => break,
                Ok(n) => filled += n,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                // A gzip stream that stops before its end.
                Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => break,
                Err(source) => {
                    return Err(VolumeError::Io { path: self.path.clone(), action: "read", source });
                }
            }
        }
        self.at += filled as u64;
        Ok(filled)
    }

    /// Reads on to the end, where gzip holds its checksum, unless much more follows.
    fn check_tail(&mut self, warnings: &mut Vec<String>) -> Result<(), VolumeError> {
        let mut tail = Vec::new();
        match self.reader.by_ref().take(TAIL).read_to_end(&mut tail) {
            Ok(0) => {}
            Ok(_) => warnings.push("there are bytes after the last voxel: ignored".into()),
            Err(source) => return Err(VolumeError::Io { path: self.path.clone(), action: "read", source }),
        }
        Ok(())
    }
}
