//! Checks that every element of a file ends within the file, before a parser allocates for it.
//!
//! A parser that trusts a length of 4 GB in a file of 1 KB allocates 4 GB, and one that follows a
//! million nested sequences overflows its stack (DICOM PS3.5, section 7).

/// Deepest nesting of sequences. Enhanced images have about four levels.
const DEEPEST: usize = 32;
/// Most elements and items, next to one for each [`BYTES_PER_ELEMENT`]. A slice has some hundred,
/// and a parser takes far more memory for a short element than the file.
const MOST: usize = 100_000;
/// An enhanced image has some hundred elements for each frame, and a frame has 100 kB or more.
const BYTES_PER_ELEMENT: usize = 500;
const ITEM: [u16; 2] = [0xfffe, 0xe000];
const ITEM_END: [u16; 2] = [0xfffe, 0xe00d];
const SEQUENCE_END: [u16; 2] = [0xfffe, 0xe0dd];
const PIXEL_DATA: [u16; 2] = [0x7fe0, 0x0010];
const UNDEFINED: u32 = u32::MAX;

/// How a data set is encoded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Encoding {
    pub(super) explicit_vr: bool,
    pub(super) big_endian: bool,
}

/// A sequence or an item that has not ended.
struct Open {
    /// Position of its end. `None` if a delimiter ends it.
    end: Option<usize>,
    /// Whether elements in it give their type.
    explicit_vr: bool,
    /// Whether it is encapsulated pixel data, whose items are not data sets.
    fragments: bool,
}

/// Returns why the data set cannot be parsed, if an element does not end in it.
pub(super) fn check(bytes: &[u8], encoding: Encoding) -> Result<(), &'static str> {
    let (mut at, mut count) = (0, 0);
    let mut open: Vec<Open> = Vec::new();
    while at < bytes.len() {
        while open.last().is_some_and(|inner| inner.end == Some(at)) {
            open.pop();
        }
        let here = open.last();
        let explicit_vr = here.map_or(encoding.explicit_vr, |inner| inner.explicit_vr);
        let fragments = here.is_some_and(|inner| inner.fragments);
        let header = Header::read(&bytes[at..], encoding.big_endian, explicit_vr)
            .ok_or("it ends within the header of an element")?;
        at += header.size;
        count += 1;
        if count > MOST + bytes.len() / BYTES_PER_ELEMENT {
            return Err("it has more than 100,000 elements and one for every 500 bytes");
        }
        match (header.tag, header.length) {
            (ITEM_END | SEQUENCE_END, _) => {
                open.pop().filter(|inner| inner.end.is_none()).ok_or("a sequence ends that did not begin")?;
            }
            (ITEM, UNDEFINED) if !fragments => open.push(Open { end: None, explicit_vr, fragments }),
            (ITEM, length) if !fragments => {
                let end = Some(end(bytes, at, length)?);
                open.push(Open { end, explicit_vr, fragments });
            }
            (tag, UNDEFINED) => {
                // A sequence of unknown type is encoded without types (PS3.5, section 6.2.2).
                let explicit_vr = explicit_vr && header.vr != *b"UN";
                open.push(Open { end: None, explicit_vr, fragments: tag == PIXEL_DATA });
            }
            (tag, length)
                if header.vr == *b"SQ" || untyped_sequence(&bytes[at..], tag, length, explicit_vr) =>
            {
                let end = Some(end(bytes, at, length)?);
                open.push(Open { end, explicit_vr, fragments: false });
            }
            (_, length) => at = end(bytes, at, length)?,
        }
        if open.len() > DEEPEST {
            return Err("its sequences are nested too deeply");
        }
    }
    match open.iter().all(|inner| inner.end == Some(at)) {
        true => Ok(()),
        false => Err("it ends within a sequence or its pixels"),
    }
}

/// Whether an element without a type holds items.
fn untyped_sequence(value: &[u8], tag: [u16; 2], length: u32, explicit_vr: bool) -> bool {
    !explicit_vr && tag != PIXEL_DATA && length >= 8 && value.starts_with(b"\xfe\xff\x00\xe0")
}

fn end(bytes: &[u8], at: usize, length: u32) -> Result<usize, &'static str> {
    let end = at.checked_add(length as usize).filter(|&end| end <= bytes.len());
    end.ok_or("it is truncated: an element is longer than the rest of the file")
}

/// The header of an element.
pub(super) struct Header {
    pub(super) tag: [u16; 2],
    /// Type of the value. Empty if the encoding does not give it.
    vr: [u8; 2],
    pub(super) length: u32,
    /// Bytes of the header.
    pub(super) size: usize,
}

impl Header {
    /// Reads a header. `None` if the bytes end within it. An unknown type has a long length, as in
    /// the parser.
    pub(super) fn read(bytes: &[u8], big_endian: bool, explicit_vr: bool) -> Option<Self> {
        let short = |at: usize| {
            let pair: [u8; 2] = bytes.get(at..at + 2)?.try_into().ok()?;
            Some(if big_endian { u16::from_be_bytes(pair) } else { u16::from_le_bytes(pair) })
        };
        let long = |at: usize| {
            let four: [u8; 4] = bytes.get(at..at + 4)?.try_into().ok()?;
            Some(if big_endian { u32::from_be_bytes(four) } else { u32::from_le_bytes(four) })
        };
        let tag = [short(0)?, short(2)?];
        if !explicit_vr || tag[0] == 0xfffe {
            return Some(Self { tag, vr: [0; 2], length: long(4)?, size: 8 });
        }
        let vr: [u8; 2] = bytes.get(4..6)?.try_into().ok()?;
        match &vr {
            b"AE" | b"AS" | b"AT" | b"CS" | b"DA" | b"DS" | b"DT" | b"FL" | b"FD" | b"IS" | b"LO" | b"LT"
            | b"PN" | b"SH" | b"SL" | b"SS" | b"ST" | b"TM" | b"UI" | b"UL" | b"US" => {
                Some(Self { tag, vr, length: u32::from(short(6)?), size: 8 })
            }
            _ => Some(Self { tag, vr, length: long(8)?, size: 12 }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXPLICIT: Encoding = Encoding { explicit_vr: true, big_endian: false };

    /// A sequence of undefined length that holds `inner` in an item of undefined length.
    fn nested(inner: &[u8]) -> Vec<u8> {
        let mut bytes = b"\x08\x00\x40\x11SQ\0\0\xff\xff\xff\xff\xfe\xff\x00\xe0\xff\xff\xff\xff".to_vec();
        bytes.extend(inner);
        bytes.extend(b"\xfe\xff\x0d\xe0\0\0\0\0\xfe\xff\xdd\xe0\0\0\0\0");
        bytes
    }

    #[test]
    fn complete_data_sets_pass() {
        let element = b"\x08\x00\x60\x00CS\x02\x00CT";
        let fragments = b"\xe0\x7f\x10\x00OB\0\0\xff\xff\xff\xff\xfe\xff\x00\xe0\0\0\0\0\
                          \xfe\xff\x00\xe0\x02\0\0\0ab\xfe\xff\xdd\xe0\0\0\0\0";
        let defined =
            b"\x08\x00\x40\x11SQ\0\0\x12\0\0\0\xfe\xff\x00\xe0\x0a\0\0\0\x08\x00\x60\x00CS\x02\x00CT";
        let implicit = b"\x08\x00\x60\x00\x02\0\0\0CT";
        assert_eq!(check(b"", EXPLICIT), Ok(()));
        for bytes in [&element[..], &fragments[..], &defined[..], &nested(element), &nested(&nested(element))]
        {
            assert_eq!(check(bytes, EXPLICIT), Ok(()), "{bytes:?}");
            // Control: the same bytes without the last one.
            assert!(check(&bytes[..bytes.len() - 1], EXPLICIT).is_err());
        }
        assert_eq!(check(implicit, Encoding { explicit_vr: false, big_endian: false }), Ok(()));
    }

    #[test]
    fn long_elements_and_deep_nesting_are_refused() {
        let long = b"\x08\x00\x00\x00OB\0\0\x00\x00\x00\xf0ab";
        assert!(check(long, EXPLICIT).unwrap_err().contains("longer than"));
        let deep = (0..40).fold(Vec::new(), |inner, _| nested(&inner));
        assert!(check(&deep, EXPLICIT).unwrap_err().contains("nested"));
        assert!(check(b"\xfe\xff\xdd\xe0\0\0\0\0", EXPLICIT).is_err());
    }

    #[test]
    fn countless_elements_are_refused() {
        let element = b"\x08\x00\x60\x00CS\0\0";
        assert_eq!(check(&element.repeat(MOST), EXPLICIT), Ok(()));
        assert!(check(&element.repeat(2 * MOST), EXPLICIT).unwrap_err().contains("100,000"));
    }
}
