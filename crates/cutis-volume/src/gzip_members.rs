//! Reads the members of a gzip file as one stream, and notices what follows the last one.

use std::io::{self, BufRead, Read};

use flate2::bufread::GzDecoder;

/// First byte of a gzip member (RFC 1952).
const MAGIC: [u8; 2] = [0x1f, 0x8b];

/// A decoder of gzip members.
///
/// Zeros between and after members are skipped, as RFC 1952 readers do with the padding of tapes
/// and blocks. Other bytes after a member end the stream ([`GzipMembers::has_trailing_bytes`]). A
/// member that is damaged or incomplete is an error.
#[derive(Debug)]
pub(crate) struct GzipMembers<R> {
    state: State<R>,
}

#[derive(Debug)]
enum State<R> {
    Member(Box<GzDecoder<R>>),
    End {
        rest: R,
        trailing: bool,
    },
    /// Only while a state is replaced.
    Moved,
}

impl<R: BufRead> GzipMembers<R> {
    /// A decoder of `raw`, which begins with a member.
    pub(crate) fn new(raw: R) -> Self {
        Self { state: State::Member(Box::new(GzDecoder::new(raw))) }
    }

    /// Whether the stream ended at bytes that are no member.
    pub(crate) fn has_trailing_bytes(&self) -> bool {
        matches!(self.state, State::End { trailing: true, .. })
    }

    /// The raw bytes that have not been read.
    pub(crate) fn into_inner(self) -> Option<R> {
        match self.state {
            State::Member(decoder) => Some(decoder.into_inner()),
            State::End { rest, .. } => Some(rest),
            State::Moved => None,
        }
    }
}

/// The state behind a member: the next member, or the end.
fn next<R: BufRead>(mut raw: R) -> (State<R>, io::Result<()>) {
    loop {
        let buffer = match raw.fill_buf() {
            Ok(buffer) => buffer,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(error) => return (State::End { rest: raw, trailing: false }, Err(error)),
        };
        let zeros = buffer.iter().take_while(|&&byte| byte == 0).count();
        // The buffer may end within the magic.
        let begins = match &buffer[zeros..] {
            [] => None,
            [first] => Some(*first == MAGIC[0]),
            [first, second, ..] => Some([*first, *second] == MAGIC),
        };
        let ends = buffer.is_empty();
        raw.consume(zeros);
        match begins {
            Some(true) => return (State::Member(Box::new(GzDecoder::new(raw))), Ok(())),
            Some(false) => return (State::End { rest: raw, trailing: true }, Ok(())),
            None if ends => return (State::End { rest: raw, trailing: false }, Ok(())),
            None => {}
        }
    }
}

impl<R: BufRead> Read for GzipMembers<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while let State::Member(decoder) = &mut self.state {
            let count = decoder.read(buffer)?;
            if count > 0 || buffer.is_empty() {
                return Ok(count);
            }
            if let State::Member(decoder) = std::mem::replace(&mut self.state, State::Moved) {
                let (state, read) = next(decoder.into_inner());
                self.state = state;
                read?;
            }
        }
        Ok(0)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    fn member(bytes: &[u8]) -> Vec<u8> {
        let mut writer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        writer.write_all(bytes).unwrap();
        writer.finish().unwrap()
    }

    /// What is read from some bytes, in buffers of this size, and whether other bytes follow.
    fn decoded(bytes: &[u8], capacity: usize) -> io::Result<(Vec<u8>, bool)> {
        let mut decoder = GzipMembers::new(io::BufReader::with_capacity(capacity, bytes));
        let mut out = Vec::new();
        decoder.read_to_end(&mut out)?;
        Ok((out, decoder.has_trailing_bytes()))
    }

    #[test]
    fn members_are_joined_zeros_are_skipped_and_other_bytes_are_noticed() {
        let two = [member(b"one "), member(b"two")].concat();
        let apart = [member(b"one "), vec![0; 1000], member(b"two"), vec![0; 512]].concat();
        let trailing = [two.clone(), vec![0; 3], b"trailing".to_vec()].concat();
        for capacity in [1, 2, 7, 1 << 16] {
            let all = b"one two".to_vec();
            assert_eq!(decoded(&two, capacity).unwrap(), (all.clone(), false), "{capacity}");
            assert_eq!(decoded(&apart, capacity).unwrap(), (all.clone(), false), "{capacity}");
            assert_eq!(decoded(&trailing, capacity).unwrap(), (all.clone(), true), "{capacity}");
            for short in 1..two.len() - 1 {
                let cut = &two[..two.len() - short];
                let at_border = cut.len() == member(b"one ").len();
                assert_eq!(decoded(cut, capacity).is_ok(), at_border, "{short} bytes short");
            }
            let mut damaged = two.clone();
            let checksum = damaged.len() - 6;
            damaged[checksum] ^= 1;
            assert!(decoded(&damaged, capacity).is_err());
        }
    }
}
