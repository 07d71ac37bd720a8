//! Reads the bytes of a volume file, decompresses them, and limits the work to the size given in
//! the header.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

use flate2::bufread::ZlibDecoder;

use super::data_file::require_file;
use crate::VolumeError;
use crate::gzip_members::GzipMembers;

/// Number of bytes decoded at a time. It is a multiple of every voxel size.
pub(crate) const PORTION: usize = 1 << 18;
/// Largest expansion by deflate: a match of 258 bytes takes at least two bits.
const DEFLATE_LIMIT: u64 = 1032;
/// Compressed voxels of up to this size may unpack from any file.
const FREE: u64 = 1 << 30;
/// Beyond it, a file may unpack to so many times its length. Scans unpack to two or three times.
const MOST_EXPANSION: u64 = 200;
/// Number of bytes read after the last voxel, to reach the gzip checksum.
const TAIL: u64 = 1 << 16;

/// Receives the raw bytes of a file, in order, with the file's path.
pub(crate) type Observer<'a> = dyn FnMut(&Path, &[u8]) + 'a;

/// Borrows the observer again, for one file.
pub(crate) fn again<'a>(observer: &'a mut Option<&mut Observer<'_>>) -> Option<&'a mut Observer<'a>> {
    match observer {
        Some(observer) => Some(&mut **observer),
        None => None,
    }
}

/// How the voxels of a file are compressed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Compression {
    Gzip,
    Zlib,
}

/// An open file, decompressed if its first bytes are those of gzip.
pub(crate) struct Source<'a> {
    pub(crate) path: PathBuf,
    stream: Stream<'a>,
    pub(crate) compressed: bool,
    /// Bytes on the disk.
    pub(crate) len: u64,
    /// Bytes delivered so far.
    at: u64,
}

impl<'a> Source<'a> {
    pub(crate) fn open(path: &Path, observer: Option<&'a mut Observer<'a>>) -> Result<Self, VolumeError> {
        Self::open_file(path, observer, true)
    }

    /// Opens a file that is not compressed as a whole, for any first bytes.
    pub(crate) fn open_plain(
        path: &Path,
        observer: Option<&'a mut Observer<'a>>,
    ) -> Result<Self, VolumeError> {
        Self::open_file(path, observer, false)
    }

    fn open_file(
        path: &Path,
        observer: Option<&'a mut Observer<'a>>,
        detect: bool,
    ) -> Result<Self, VolumeError> {
        let failed = |source| VolumeError::Io { path: path.into(), action: "read", source };
        require_file(path)?;
        let mut file = File::open(path).map_err(failed)?;
        let len = file.metadata().map_err(failed)?.len();
        let mut magic = Vec::with_capacity(2);
        file.by_ref().take(2).read_to_end(&mut magic).map_err(failed)?;
        let compressed = detect && magic == [0x1f, 0x8b];
        let observed = Observed { path: path.into(), file: io::Cursor::new(magic).chain(file), observer };
        let buffered = BufReader::with_capacity(PORTION, observed);
        let stream = match compressed {
            true => Stream::Gzip(Box::new(GzipMembers::new(buffered))),
            false => Stream::Plain(buffered),
        };
        Ok(Self { path: path.into(), stream, compressed, len, at: 0 })
    }

    /// Decompresses the rest of the file from here on. Positions then count decompressed bytes.
    pub(crate) fn decompress(mut self, compression: Compression) -> Self {
        self.stream = match (self.stream, compression) {
            (Stream::Plain(raw), Compression::Gzip) => Stream::Gzip(Box::new(GzipMembers::new(raw))),
            (Stream::Plain(raw), Compression::Zlib) => Stream::Zlib(Box::new(ZlibDecoder::new(raw))),
            (other, _) => other,
        };
        self.compressed = true;
        self.at = 0;
        self
    }

    /// Number of bytes delivered so far.
    pub(crate) fn position(&self) -> u64 {
        self.at
    }

    /// Returns an error if a file of this length cannot hold the voxels, or would unpack to so much
    /// that it is made to fill the memory.
    pub(crate) fn expect(&self, voxel_offset: u64, bytes: u64) -> Result<(), VolumeError> {
        let most = if self.compressed { self.len.saturating_mul(DEFLATE_LIMIT) } else { self.len };
        let usual = if self.compressed { self.len.saturating_mul(MOST_EXPANSION).max(FREE) } else { most };
        match voxel_offset.checked_add(bytes) {
            Some(end) if end <= usual => Ok(()),
            Some(end) if end <= most => {
                let (path, file_bytes) = (self.path.clone(), self.len);
                Err(VolumeError::Expansion { path, file_bytes, bytes: end, times: MOST_EXPANSION })
            }
            _ => Err(VolumeError::Truncated {
                path: self.path.clone(),
                expected_bytes: bytes,
                found_bytes: most.saturating_sub(voxel_offset),
            }),
        }
    }

    pub(crate) fn skip_to(&mut self, voxel_offset: u64, bytes: u64) -> Result<(), VolumeError> {
        let mut skipped = vec![0; PORTION];
        while self.at < voxel_offset {
            let wanted = PORTION.min((voxel_offset - self.at) as usize);
            if self.fill(&mut skipped[..wanted])? < wanted {
                return Err(VolumeError::Truncated {
                    path: self.path.clone(),
                    expected_bytes: bytes,
                    found_bytes: 0,
                });
            }
        }
        Ok(())
    }

    /// Reads until the buffer is full or the file ends. Returns the number of bytes read.
    pub(crate) fn fill(&mut self, buffer: &mut [u8]) -> Result<usize, VolumeError> {
        let mut filled = 0;
        while filled < buffer.len() {
            match self.stream.read(&mut buffer[filled..]) {
                Ok(0) => break,
                Ok(n) => filled += n,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                // The gzip stream is truncated.
                Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => break,
                Err(source) => {
                    return Err(VolumeError::Io { path: self.path.clone(), action: "read", source });
                }
            }
        }
        self.at += filled as u64;
        Ok(filled)
    }

    /// Reads a limited number of bytes after the last voxel. The decoder verifies the gzip checksum
    /// if the file ends within them.
    pub(crate) fn check_tail(&mut self, warnings: &mut Vec<String>) -> Result<(), VolumeError> {
        let mut tail = Vec::new();
        match self.stream.by_ref().take(TAIL).read_to_end(&mut tail) {
            Ok(0) => {}
            Ok(_) => warnings.push("there are bytes after the last voxel: they are ignored".into()),
            Err(source) => return Err(VolumeError::Io { path: self.path.clone(), action: "read", source }),
        }
        if matches!(&self.stream, Stream::Gzip(members) if members.has_trailing_bytes()) {
            warnings.push("there are bytes after the last gzip member: they are ignored".into());
        }
        Ok(())
    }

    /// Reads the remaining raw bytes and passes them to the observer. Does nothing without an
    /// observer.
    pub(crate) fn finish(self) -> Result<(), VolumeError> {
        let mut raw = match self.stream {
            Stream::Plain(raw) => raw,
            Stream::Gzip(members) => match members.into_inner() {
                Some(raw) => raw,
                None => return Ok(()),
            },
            Stream::Zlib(decoder) => decoder.into_inner(),
        };
        if raw.get_ref().observer.is_some() {
            io::copy(&mut raw, &mut io::sink()).map_err(|source| VolumeError::Io {
                path: self.path,
                action: "read",
                source,
            })?;
        }
        Ok(())
    }
}

enum Stream<'a> {
    Plain(BufReader<Observed<'a>>),
    Gzip(Box<GzipMembers<BufReader<Observed<'a>>>>),
    Zlib(Box<ZlibDecoder<BufReader<Observed<'a>>>>),
}

impl Read for Stream<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::Plain(raw) => raw.read(buffer),
            Self::Gzip(decoder) => decoder.read(buffer),
            Self::Zlib(decoder) => decoder.read(buffer),
        }
    }
}

/// The raw bytes of a file, shown to the observer as they are read.
struct Observed<'a> {
    path: PathBuf,
    file: io::Chain<io::Cursor<Vec<u8>>, File>,
    observer: Option<&'a mut Observer<'a>>,
}

impl Read for Observed<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read(buffer)?;
        if let Some(observer) = &mut self.observer {
            observer(&self.path, &buffer[..count]);
        }
        Ok(count)
    }
}
