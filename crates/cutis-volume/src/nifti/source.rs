//! The bytes of a NIfTI file: decompressed, counted, and never more than the header promises.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

use flate2::bufread::MultiGzDecoder;

use super::header::Header;
use crate::VolumeError;

/// Bytes decoded at a time; a multiple of every voxel size.
pub(super) const PORTION: usize = 1 << 18;
/// Deflate cannot expand a byte to more than this (a match of 258 bytes takes at least two bits).
const DEFLATE_LIMIT: u64 = 1032;
/// Bytes looked at after the last voxel, to reach the gzip checksum.
const TAIL: u64 = 1 << 16;

/// An open file, decompressed where its first bytes say gzip.
pub(super) struct Source {
    pub(super) path: PathBuf,
    reader: Box<dyn Read>,
    pub(super) compressed: bool,
    /// Bytes on the disk.
    pub(super) len: u64,
    /// Bytes delivered so far.
    at: u64,
}

impl Source {
    pub(super) fn open(path: &Path) -> Result<Self, VolumeError> {
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

    pub(super) fn header(&mut self) -> Result<Header, VolumeError> {
        let mut bytes = vec![0; 4];
        let reason = "it is shorter than a header";
        let short = VolumeError::NotNifti { path: self.path.clone(), reason };
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
    pub(super) fn expect(&self, voxel_offset: u64, bytes: u64) -> Result<(), VolumeError> {
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

    pub(super) fn skip_to(&mut self, voxel_offset: u64, bytes: u64) -> Result<(), VolumeError> {
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
    pub(super) fn fill(&mut self, buffer: &mut [u8]) -> Result<usize, VolumeError> {
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
    pub(super) fn check_tail(&mut self, warnings: &mut Vec<String>) -> Result<(), VolumeError> {
        let mut tail = Vec::new();
        match self.reader.by_ref().take(TAIL).read_to_end(&mut tail) {
            Ok(0) => {}
            Ok(_) => warnings.push("there are bytes after the last voxel: ignored".into()),
            Err(source) => return Err(VolumeError::Io { path: self.path.clone(), action: "read", source }),
        }
        Ok(())
    }
}
