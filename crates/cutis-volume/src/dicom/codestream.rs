//! Checks of compressed pixels before they are decoded: each codestream states its own size, which
//! must be that of the slice. Else a decoder would write beyond the slice, or fill a part of it.

use std::path::Path;

use super::error::DicomError;
use super::slice::PixelFormat;

/// Whether a transfer syntax is read, by its UID.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Codec {
    Raw,
    Jpeg,
    Rle,
    Jpeg2000,
    /// Not read: name and remedy.
    Refused(&'static str, &'static str),
}

/// What to do with a compression that is not read.
const DECOMPRESS: &str = "decompress the files first, for example with `gdcmconv --raw IN OUT`";

/// Most pixels per byte of a lossless JPEG stream: each has a code of at least one bit.
const LOSSLESS: usize = 8;
/// Most pixels per byte of a lossy JPEG stream: a block of 64 has a code of at least one bit.
const LOSSY: usize = 512;
/// Most pixels per byte of a large JPEG 2000 stream. Scans have fewer than ten.
const JPEG_2000: usize = 1000;
/// Pixels that a JPEG 2000 stream of any length may have: an empty slice takes a few bytes.
const FREE: usize = 1 << 22;
/// Most tiles of a JPEG 2000 image. Each takes some kilobytes of memory.
const MOST_TILES: usize = 1024;

impl Codec {
    pub(super) fn of(uid: &str) -> Self {
        match uid {
            "1.2.840.10008.1.2"
            | "1.2.840.10008.1.2.1"
            | "1.2.840.10008.1.2.2"
            | "1.2.840.10008.1.2.1.99" => Self::Raw,
            "1.2.840.10008.1.2.4.50"
            | "1.2.840.10008.1.2.4.51"
            | "1.2.840.10008.1.2.4.57"
            | "1.2.840.10008.1.2.4.70" => Self::Jpeg,
            "1.2.840.10008.1.2.5" => Self::Rle,
            "1.2.840.10008.1.2.4.90" | "1.2.840.10008.1.2.4.91" if cfg!(feature = "dicom-jpeg2000") => {
                Self::Jpeg2000
            }
            "1.2.840.10008.1.2.4.90" | "1.2.840.10008.1.2.4.91" => Self::Refused(
                "JPEG 2000",
                "build Cutis with the feature dicom-jpeg2000, or decompress the files first, for example with `gdcmconv \
                 --raw IN OUT`",
            ),
            "1.2.840.10008.1.2.4.80" | "1.2.840.10008.1.2.4.81" => Self::Refused(
                "JPEG-LS",
                "decompress the files first, for example with `dcmdjpls IN OUT` or `gdcmconv --raw IN OUT`",
            ),
            "1.2.840.10008.1.2.4.53" | "1.2.840.10008.1.2.4.55" => {
                Self::Refused("a retired form of JPEG", DECOMPRESS)
            }
            _ => Self::Refused("a compression that Cutis does not know", DECOMPRESS),
        }
    }
}

impl Codec {
    /// The codec of a transfer syntax.
    ///
    /// # Errors
    /// [`DicomError::Compression`] for one that is not read.
    pub(super) fn require(path: &Path, uid: &str) -> Result<Self, DicomError> {
        match Self::of(uid) {
            Self::Refused(name, remedy) => {
                let known = uid.len() <= 64 && uid.chars().all(|c| c.is_ascii_digit() || c == '.');
                let syntax = format!("{name} (transfer syntax {})", if known { uid } else { "unknown" });
                Err(DicomError::Compression { path: path.into(), syntax, remedy })
            }
            codec => Ok(codec),
        }
    }
}

/// Returns why a codestream cannot be decoded to `size` pixels.
pub(super) fn check(
    codec: Codec,
    stream: &[u8],
    size: [usize; 2],
    format: PixelFormat,
) -> Result<(), &'static str> {
    match codec {
        Codec::Jpeg => {
            let (found, bits, lossless) =
                jpeg_size(stream).ok_or("the JPEG stream has no header of a frame")?;
            if bits > 8 && !lossless {
                return Err(
                    "lossy JPEG of more than 8 bits is not read; decompress the files first, for example with `gdcmconv --raw IN OUT`",
                );
            }
            same_size(found, size)?;
            dense(size, stream, if lossless { LOSSLESS } else { LOSSY })?;
            wide_enough(bits, format)
        }
        Codec::Jpeg2000 => {
            let (found, bits, tiles) =
                jpeg2000_size(stream).ok_or("the JPEG 2000 stream has no header of an image")?;
            same_size(found, size)?;
            if tiles > MOST_TILES {
                return Err("the JPEG 2000 image is divided into more than 1024 tiles");
            }
            if size[0] * size[1] > FREE {
                dense(size, stream, JPEG_2000)?;
            }
            wide_enough(bits, format)
        }
        Codec::Rle => rle(stream, size[0] * size[1], format.bits_allocated as usize / 8),
        Codec::Raw | Codec::Refused(..) => Ok(()),
    }
}

/// Refuses a stream that is too short for its image, before a decoder allocates for it.
fn dense(size: [usize; 2], stream: &[u8], pixels_per_byte: usize) -> Result<(), &'static str> {
    match size[0] * size[1] <= stream.len().saturating_mul(pixels_per_byte) {
        true => Ok(()),
        false => Err("the compressed stream is too short for Columns x Rows pixels"),
    }
}

fn same_size(found: [usize; 2], expected: [usize; 2]) -> Result<(), &'static str> {
    if found == expected { Ok(()) } else { Err("the compressed image is not of size Columns x Rows") }
}

/// A stream of at most 8 bits decodes to one byte per pixel, another one to two.
fn wide_enough(bits: u8, format: PixelFormat) -> Result<(), &'static str> {
    let bytes = if bits <= 8 { 1 } else { 2 };
    match bytes * 8 == format.bits_allocated && u32::from(bits) >= format.bits_stored {
        true => Ok(()),
        false => Err("the compressed image has another number of bits than the header says"),
    }
}

/// Columns, rows and bits of the start of frame of a JPEG stream, and whether it is lossless
/// (ISO 10918-1, B.2.2).
fn jpeg_size(stream: &[u8]) -> Option<([usize; 2], u8, bool)> {
    let mut at = 2;
    loop {
        let header = stream.get(at..at + 4)?;
        let length = usize::from(u16::from_be_bytes([header[2], header[3]]));
        match header[1] {
            _ if header[0] != 0xff => return None,
            0xff => at += 1,
            0xc0..=0xc3 | 0xc5..=0xc7 | 0xc9..=0xcb | 0xcd..=0xcf => {
                let frame = stream.get(at + 4..at + 10)?;
                let [rows, columns] =
                    [1, 3].map(|n| usize::from(u16::from_be_bytes([frame[n], frame[n + 1]])));
                return (frame[5] == 1).then_some(([columns, rows], frame[0], header[1] == 0xc3));
            }
            _ => at += 2 + length,
        }
    }
}

/// Columns and rows, bits, and the number of tiles from the SIZ segment, the first one of a JPEG
/// 2000 codestream (ISO 15444-1, A.5.1). A JP2 file has boxes before the codestream.
fn jpeg2000_size(stream: &[u8]) -> Option<([usize; 2], u8, usize)> {
    let start = stream.windows(4).position(|bytes| bytes == [0xff, 0x4f, 0xff, 0x51])?;
    let siz = stream.get(start + 4..start + 44)?;
    let number = |at: usize| Some(u32::from_be_bytes(siz.get(at..at + 4)?.try_into().ok()?) as usize);
    let (mut size, mut tiles) = ([0; 2], 1usize);
    for axis in 0..2 {
        let [end, first, tile, first_tile] = [4, 12, 20, 28].map(|at| number(at + 4 * axis));
        let tile = tile.filter(|&tile| tile > 0)?;
        size[axis] = end?.checked_sub(first?)?;
        tiles = tiles.checked_mul(end?.checked_sub(first_tile?)?.div_ceil(tile))?;
    }
    let components = u16::from_be_bytes([siz[36], siz[37]]);
    (components == 1).then_some((size, (siz[38] & 0x7f) + 1, tiles))
}

/// Each byte of a pixel has a segment of runs. Each must have at least `pixels` bytes (PS3.5,
/// annex G).
fn rle(stream: &[u8], pixels: usize, bytes: usize) -> Result<(), &'static str> {
    const SHORT: &str = "the RLE header is damaged";
    let number = |at: usize| -> Option<usize> {
        Some(u32::from_le_bytes(stream.get(at..at + 4)?.try_into().ok()?) as usize)
    };
    if stream.len() < 64 || number(0) != Some(bytes) {
        return Err(SHORT);
    }
    for segment in 0..bytes {
        let start = number(4 + 4 * segment).ok_or(SHORT)?;
        let end = if segment + 1 < bytes { number(8 + 4 * segment).ok_or(SHORT)? } else { stream.len() };
        let runs = stream.get(start..end).ok_or(SHORT)?;
        let (mut at, mut decoded) = (0, 0);
        while at < runs.len() && decoded < pixels {
            let (consumed, produced) = match runs[at] {
                literal @ 0..=127 => (usize::from(literal) + 2, usize::from(literal) + 1),
                128 => (1, 0),
                repeat => (2, 257 - usize::from(repeat)),
            };
            if at + consumed > runs.len() {
                return Err("an RLE segment is truncated");
            }
            at += consumed;
            decoded += produced;
        }
        if decoded < pixels {
            return Err("an RLE segment is shorter than the image");
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const FORMAT: PixelFormat =
        PixelFormat { bits_allocated: 16, bits_stored: 12, high_bit: 11, signed: false };

    #[test]
    fn a_jpeg_stream_of_another_size_is_refused() {
        let stream = |rows: u8, bits: u8| {
            vec![0xff, 0xd8, 0xff, 0xe0, 0, 4, 1, 2, 0xff, 0xc3, 0, 11, bits, 0, rows, 0, 6, 1, 1, 0x11, 0]
        };
        assert_eq!(check(Codec::Jpeg, &stream(5, 16), [6, 5], FORMAT), Ok(()));
        assert!(check(Codec::Jpeg, &stream(4, 16), [6, 5], FORMAT).is_err());
        assert!(check(Codec::Jpeg, &stream(5, 8), [6, 5], FORMAT).is_err());
        assert!(check(Codec::Jpeg, &stream(5, 16)[..12], [6, 5], FORMAT).is_err());
    }

    #[test]
    fn a_jpeg_2000_stream_of_another_size_is_refused() {
        let stream = |columns: u8| {
            let mut bytes = vec![0xff, 0x4f, 0xff, 0x51, 0, 41, 0, 0, 0, 0, 0, columns, 0, 0, 0, 5];
            bytes.resize(40, 0);
            bytes.extend([0, 1, 11, 1, 1, 0, 0, 0, 0]);
            // Tiles of one column and five rows.
            (bytes[27], bytes[31]) = (1, 5);
            bytes
        };
        assert_eq!(check(Codec::Jpeg2000, &stream(6), [6, 5], FORMAT), Ok(()));
        assert!(check(Codec::Jpeg2000, &stream(7), [6, 5], FORMAT).is_err());
        assert!(check(Codec::Jpeg2000, &stream(6)[..30], [6, 5], FORMAT).is_err());
        assert_eq!(jpeg2000_size(&stream(6)).map(|(.., tiles)| tiles), Some(6));
    }

    /// Sizes and streams that agree with each other, but would take gigabytes.
    #[test]
    fn streams_that_are_too_short_for_their_image_are_refused() {
        let jpeg = |kind: u8| {
            let mut bytes = vec![0xff, 0xd8, 0xff, kind, 0, 11, 8, 0, 64, 0, 64, 1, 1, 0x11, 0];
            bytes.resize(64, 0);
            bytes
        };
        let format = PixelFormat { bits_allocated: 8, bits_stored: 8, high_bit: 7, signed: false };
        let size = [64, 64];
        assert_eq!(check(Codec::Jpeg, &jpeg(0xc0), size, format), Ok(()));
        assert!(check(Codec::Jpeg, &jpeg(0xc3), size, format).unwrap_err().contains("too short"));
        assert_eq!(check(Codec::Jpeg, &[jpeg(0xc3), vec![0; 512]].concat(), size, format), Ok(()));
        let jpeg2000 = |side: u16, tile: u16| {
            let mut bytes = vec![0xff, 0x4f, 0xff, 0x51, 0, 41, 0, 0];
            for number in [side, side, 0, 0, tile, tile, 0, 0] {
                bytes.extend(u32::from(number).to_be_bytes());
            }
            bytes.extend([0, 1, 11, 1, 1, 0, 0, 0, 0]);
            bytes
        };
        let checked = |side: u16, tile: u16| {
            check(Codec::Jpeg2000, &jpeg2000(side, tile), [usize::from(side); 2], FORMAT)
        };
        assert_eq!((checked(2048, 2048), checked(2048, 64)), (Ok(()), Ok(())));
        assert!(checked(2048, 32).unwrap_err().contains("tiles"));
        assert!(checked(65535, 65535).unwrap_err().contains("too short"));
    }

    #[test]
    fn short_rle_segments_are_refused() {
        let stream = |runs: &[u8]| {
            let mut bytes = vec![0; 64];
            bytes[0] = 2;
            bytes[4] = 64;
            bytes[8] = 64 + runs.len() as u8;
            bytes.extend(runs);
            bytes.extend(runs);
            bytes
        };
        // Three literal bytes and 27 equal ones.
        let runs = [2, 1, 2, 3, 230, 7];
        assert_eq!(check(Codec::Rle, &stream(&runs), [6, 5], FORMAT), Ok(()));
        assert!(check(Codec::Rle, &stream(&runs), [6, 6], FORMAT).is_err());
        assert!(check(Codec::Rle, &stream(&runs[..5]), [6, 5], FORMAT).is_err());
        assert!(check(Codec::Rle, &stream(&runs)[..63], [6, 5], FORMAT).is_err());
    }
}
