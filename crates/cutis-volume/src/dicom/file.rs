//! Opens one DICOM file: its bytes, its encoding and its data set.

use std::fs::File;
use std::io::{Cursor, Read};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use dicom_encoding::transfer_syntax::TransferSyntaxIndex;
use dicom_object::{DefaultDicomObject, OpenFileOptions, Tag};
use dicom_transfer_syntax_registry::TransferSyntaxRegistry;
use flate2::read::DeflateDecoder;

use super::codestream::Codec;
use super::error::DicomError;
use super::lengths::{self, Encoding, Header};
use crate::VolumeError;

/// Bytes of preamble and prefix at the beginning of a file (PS3.10, section 7.1).
const PREFIX: usize = 132;
/// Largest file. A slice has about half a megabyte, and a file with several some hundred slices.
const LARGEST: u64 = 1 << 31;
/// Largest expansion of a deflated file. Slices expand by a factor of two to ten.
const MOST_INFLATED: u64 = 200;
const DEFLATED: &str = "1.2.840.10008.1.2.1.99";

/// Whether the file begins as a DICOM file does.
pub(crate) fn is_dicom(path: &Path) -> bool {
    let mut start = Vec::with_capacity(PREFIX);
    let read = File::open(path).and_then(|file| file.take(PREFIX as u64).read_to_end(&mut start));
    read.is_ok() && start.get(128..) == Some(b"DICM")
}

/// All bytes of a file.
pub(super) fn bytes(path: &Path) -> Result<Vec<u8>, VolumeError> {
    let failed = |source| VolumeError::Io { path: path.into(), action: "read", source };
    let mut file = File::open(path).map_err(failed)?;
    if file.metadata().map_err(failed)?.len() > LARGEST {
        let reason = "it has more than 2 GB";
        return Err(DicomError::Damaged { path: path.into(), reason }.into());
    }
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(failed)?;
    Ok(bytes)
}

/// Parses a file. Without `whole`, parsing ends before the pixels.
///
/// # Errors
/// [`DicomError::Damaged`]. The messages of the parser are not used, because they quote values.
pub(super) fn parse(path: &Path, bytes: &[u8], whole: bool) -> Result<DefaultDicomObject, DicomError> {
    let damaged = |reason| DicomError::Damaged { path: path.into(), reason };
    let (syntax, start) = transfer_syntax(bytes).map_err(damaged)?;
    if TransferSyntaxRegistry.get(&syntax).is_none() {
        // The library does not parse the header of such a file.
        Codec::require(path, &syntax)?;
    }
    check_lengths(&bytes[start..], &syntax).map_err(damaged)?;
    let options = match whole {
        true => OpenFileOptions::new().read_all(),
        false => OpenFileOptions::new().read_until(Tag(0x7fe0, 0x0010)),
    };
    match catch_unwind(AssertUnwindSafe(|| options.from_reader(Cursor::new(bytes)))) {
        Ok(Ok(object)) => Ok(object),
        Ok(Err(_)) => {
            Err(damaged("its data set has an unknown encoding or transfer syntax, or a damaged element"))
        }
        Err(_) => Err(damaged("its data set cannot be parsed")),
    }
}

/// The transfer syntax in the file meta information, and the position of the data set after it. The
/// elements are those that the parser sees, so that it allocates for no longer ones.
fn transfer_syntax(bytes: &[u8]) -> Result<(String, usize), &'static str> {
    const SHORT: &str = "its file meta information is incomplete";
    if bytes.get(128..PREFIX) != Some(b"DICM") {
        return Err("the letters DICM are missing at byte 128");
    }
    let (mut at, mut syntax, mut promised) = (PREFIX, None, None);
    while bytes.get(at..at + 2) == Some(&[2, 0]) {
        let header = Header::read(&bytes[at..], false, true).ok_or(SHORT)?;
        let value = at + header.size;
        at = value.checked_add(header.length as usize).ok_or(SHORT)?;
        let value = bytes.get(value..at).ok_or(SHORT)?;
        match header.tag[1] {
            // The length of all that follows.
            0 => promised = value.first_chunk().map(|&length| at + u32::from_le_bytes(length) as usize),
            0x10 => syntax = Some(String::from_utf8_lossy(value).trim_end_matches(['\0', ' ']).to_owned()),
            _ => {}
        }
    }
    if promised.is_some_and(|end| end > at) {
        return Err("its file meta information ends before the length that it states");
    }
    Ok((syntax.ok_or("its file meta information names no transfer syntax")?, at))
}

fn check_lengths(data_set: &[u8], syntax: &str) -> Result<(), &'static str> {
    let encoding =
        Encoding { explicit_vr: syntax != "1.2.840.10008.1.2", big_endian: syntax == "1.2.840.10008.1.2.2" };
    if syntax != DEFLATED {
        return lengths::check(data_set, encoding);
    }
    let limit = (data_set.len() as u64).saturating_mul(MOST_INFLATED).min(LARGEST);
    let mut inflated = Vec::new();
    let read = DeflateDecoder::new(data_set).take(limit + 1).read_to_end(&mut inflated);
    match read {
        Ok(count) if count as u64 <= limit => lengths::check(&inflated, encoding),
        Ok(_) => Err("its deflated data set is far larger than the file"),
        Err(_) => Err("its deflated data set is damaged"),
    }
}
