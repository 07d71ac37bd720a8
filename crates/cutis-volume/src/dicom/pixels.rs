//! Pixels of one slice: decoded to stored values, then to HU.

use std::panic::{AssertUnwindSafe, catch_unwind};

use dicom_core::value::Value;
use dicom_object::{DefaultDicomObject, Tag};
use dicom_pixeldata::PixelDecoder;

use super::codestream::{self, Codec};
use super::error::DicomError;
use super::slice::{PixelFormat, Slice};

/// The HU of one slice, rounded to whole numbers.
pub(super) struct Pixels {
    pub(super) hu: Vec<i16>,
    /// Lowest and highest value before rounding, without padding.
    pub(super) min: f64,
    pub(super) max: f64,
    pub(super) sum: f64,
    /// Largest change by rounding.
    pub(super) rounding: f64,
    pub(super) padding: u64,
}

/// Decodes the pixels of a slice. Padding becomes −1024 HU.
///
/// # Errors
/// [`DicomError::Compression`] or [`DicomError::Pixels`].
pub(super) fn decode(slice: &Slice, object: &DefaultDicomObject) -> Result<Pixels, DicomError> {
    let PixelFormat { bits_allocated, .. } = slice.format;
    let bytes = stored_bytes(slice, object)?;
    let count = slice.size[0] * slice.size[1];
    let sample = bits_allocated as usize / 8;
    // A byte of padding makes an odd number of bytes even.
    if bytes.len() < count * sample || bytes.len() > count * sample + 1 {
        let reason = "there are not Columns x Rows values";
        return Err(DicomError::Pixels { slice: slice.source.clone(), reason });
    }
    Ok(match sample {
        1 => convert(slice, bytes[..count].iter().map(|&byte| u16::from(byte))),
        _ => convert(slice, bytes.as_chunks::<2>().0.iter().map(|&pair| u16::from_le_bytes(pair))),
    })
}

fn stored_bytes(slice: &Slice, object: &DefaultDicomObject) -> Result<Vec<u8>, DicomError> {
    let damaged = |reason| DicomError::Pixels { slice: slice.source.clone(), reason };
    let codec = Codec::require(&slice.source.path, object.meta().transfer_syntax())?;
    let element = object.get(Tag(0x7fe0, 0x0010)).ok_or(damaged("the attribute PixelData is missing"))?;
    match (codec, element.value()) {
        (Codec::Raw, Value::Primitive(_)) => {}
        (Codec::Raw, _) => return Err(damaged("they are divided into fragments, but not compressed")),
        (_, Value::PixelSequence(sequence)) => {
            let stream = sequence.fragments().concat();
            codestream::check(codec, &stream, slice.size, slice.format).map_err(damaged)?;
        }
        _ => return Err(damaged("they are not divided into fragments, as compressed ones are")),
    }
    // A decoder that panics must not end the program.
    match catch_unwind(AssertUnwindSafe(|| object.decode_pixel_data().map(|decoded| decoded.data().to_vec())))
    {
        Ok(Ok(bytes)) => Ok(bytes),
        _ => Err(damaged("the decoder of the library dicom-pixeldata does not read them")),
    }
}

/// Bits `high_bit` down to `high_bit − bits_stored + 1` are the value. The others may hold
/// anything, for example an overlay (PS3.5, section 8.1.1).
fn stored(raw: u16, format: PixelFormat) -> i64 {
    let value = i64::from(raw) >> (format.high_bit + 1 - format.bits_stored);
    let value = value & ((1 << format.bits_stored) - 1);
    let negative = format.signed && value >> (format.bits_stored - 1) == 1;
    if negative { value - (1 << format.bits_stored) } else { value }
}

fn convert(slice: &Slice, raw: impl Iterator<Item = u16>) -> Pixels {
    let [slope, intercept] = slice.rescale;
    let format = slice.format;
    let whole =
        PixelFormat { bits_stored: format.bits_allocated, high_bit: format.bits_allocated - 1, ..format };
    // Some scanners write padding over all bits, outside the range of BitsStored.
    let is_padding = |raw: u16, value: i64| {
        slice
            .padding
            .is_some_and(|[low, high]| [value, stored(raw, whole)].iter().any(|v| (low..=high).contains(v)))
    };
    let mut pixels = Pixels {
        hu: Vec::with_capacity(slice.size[0] * slice.size[1]),
        min: f64::INFINITY,
        max: f64::NEG_INFINITY,
        sum: 0.0,
        rounding: 0.0,
        padding: 0,
    };
    for raw in raw {
        let value = stored(raw, format);
        if is_padding(raw, value) {
            pixels.padding += 1;
            pixels.hu.push(crate::AIR_HU as i16);
            continue;
        }
        let hu = slope * value as f64 + intercept;
        pixels.min = pixels.min.min(hu);
        pixels.max = pixels.max.max(hu);
        pixels.sum += hu;
        pixels.rounding = pixels.rounding.max((hu - hu.round()).abs());
        pixels.hu.push(hu.round() as i16);
    }
    pixels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unused_bits_are_removed_and_the_sign_extended() {
        let format =
            |bits_stored, high_bit, signed| PixelFormat { bits_allocated: 16, bits_stored, high_bit, signed };
        let cases = [
            (0xf7ff, format(12, 11, false), 0x7ff),
            (0xf800, format(12, 11, true), -2048),
            (0x0fff, format(12, 11, true), -1),
            (0x7ff5, format(12, 14, false), 0xffe),
            (0xffff, format(16, 15, true), -1),
            (0xffff, format(16, 15, false), 65535),
            (0x8000, format(12, 15, true), -2048),
        ];
        for (raw, format, expected) in cases {
            assert_eq!(stored(raw, format), expected, "{raw:x} {format:?}");
        }
    }
}
