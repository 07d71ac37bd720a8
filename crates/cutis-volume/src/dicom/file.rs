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
use super::lengths::{self, Encoding};
use crate::VolumeError;

/// Bytes of preamble and prefix at the beginning of a file (PS3.10, section 7.1).
const PREFIX: usize = 132;
/// Largest file. A slice has about half a megabyte, and an uncompressed one at most 8 GB.
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
        let reason = "it has more than 2 GB, which no single slice has";
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

/// The transfer syntax in the file meta information, and the position of the data set after it.
fn transfer_syntax(bytes: &[u8]) -> Result<(String, usize), &'static str> {
    const SHORT: &str = "its file meta information is incomplete";
    if bytes.get(128..PREFIX) != Some(b"DICM") {
        return Err("the letters DICM are missing at byte 128");
    }
    let (mut at, mut syntax) = (PREFIX, None);
    while bytes.get(at..at + 2) == Some(&[2, 0]) {
        let header = bytes.get(at..at + 8).ok_or(SHORT)?;
        let (length, value) = match &header[4..6] {
            b"OB" | b"OW" | b"UN" | b"UT" | b"UR" | b"UC" => {
                let long: [u8; 4] = bytes.get(at + 8..at + 12).ok_or(SHORT)?.try_into().map_err(|_| SHORT)?;
                (u32::from_le_bytes(long) as usize, at + 12)
            }
            _ => (usize::from(u16::from_le_bytes([header[6], header[7]])), at + 8),
        };
        let end = value.checked_add(length).ok_or(SHORT)?;
        let text = bytes.get(value..end).ok_or(SHORT)?;
        if header[2..4] == [0x10, 0] {
            syntax = Some(String::from_utf8_lossy(text).trim_end_matches(['\0', ' ']).to_owned());
        }
        at = end;
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
