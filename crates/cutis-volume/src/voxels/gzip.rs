//! Parallel gzip compression into one member, with the same bytes for any number of threads.
//!
//! The stream is divided into blocks of fixed size, which are deflated independently. Each ends
//! with a sync flush: an empty stored block that completes the last byte (RFC 1951). Therefore the
//! compressed blocks can be concatenated. Their checksums are combined (RFC 1952).

use std::io::{self, Write};

use flate2::{Compress, Compression, Crc, FlushCompress, Status};
use rayon::prelude::*;

/// Uncompressed bytes per block. Blocks of this size compress about as well as one long stream.
const BLOCK: usize = 1 << 20;
/// Number of blocks compressed at a time. It limits the memory and the number of busy threads.
const BATCH: usize = 16;
/// A fast level. Higher levels gain little on CT noise.
const LEVEL: u32 = 2;
/// Magic bytes, method deflate, no flags, no time stamp, no extra flags, unknown system. Without a
/// time stamp the bytes depend on the data only.
const MEMBER_HEADER: [u8; 10] = [0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 255];
/// An empty last block with fixed codes.
const LAST_BLOCK: [u8; 2] = [3, 0];

/// A writer that compresses its input and writes it to `inner`.
pub(crate) struct GzipWriter<W: Write> {
    inner: W,
    pending: Vec<u8>,
    crc: Crc,
}

impl<W: Write> GzipWriter<W> {
    pub(crate) fn new(mut inner: W) -> io::Result<Self> {
        inner.write_all(&MEMBER_HEADER)?;
        Ok(Self { inner, pending: Vec::new(), crc: Crc::new() })
    }

    /// Writes the remaining blocks and the trailer.
    pub(crate) fn finish(mut self) -> io::Result<W> {
        self.compress(self.pending.len())?;
        self.inner.write_all(&LAST_BLOCK)?;
        self.inner.write_all(&self.crc.sum().to_le_bytes())?;
        self.inner.write_all(&self.crc.amount().to_le_bytes())?;
        Ok(self.inner)
    }

    fn compress(&mut self, len: usize) -> io::Result<()> {
        let blocks: Vec<(Crc, io::Result<Vec<u8>>)> = self.pending[..len]
            .par_chunks(BLOCK)
            .map(|block| {
                let mut crc = Crc::new();
                crc.update(block);
                (crc, deflate(block))
            })
            .collect();
        for (crc, block) in blocks {
            self.inner.write_all(&block?)?;
            self.crc.combine(&crc);
        }
        self.pending.drain(..len);
        Ok(())
    }
}

impl<W: Write> Write for GzipWriter<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        // Blocks start at multiples of BLOCK in the stream, however the caller divides its writes.
        let taken = bytes.len().min(BLOCK * BATCH - self.pending.len());
        self.pending.extend_from_slice(&bytes[..taken]);
        if self.pending.len() == BLOCK * BATCH {
            self.compress(BLOCK * BATCH)?;
        }
        Ok(taken)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

fn deflate(block: &[u8]) -> io::Result<Vec<u8>> {
    let mut state = Compress::new(Compression::new(LEVEL), false);
    let mut out = Vec::with_capacity(block.len() / 2 + 64);
    loop {
        let done = state.total_in() as usize;
        let status =
            state.compress_vec(&block[done..], &mut out, FlushCompress::Sync).map_err(io::Error::from)?;
        // The flush is complete when all input is consumed and the output still has space.
        if state.total_in() as usize == block.len() && out.len() < out.capacity() {
            return Ok(out);
        }
        if status == Status::StreamEnd {
            return Err(io::ErrorKind::Other.into());
        }
        out.reserve(block.len() / 2 + 64);
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use super::*;

    fn noise(len: usize) -> Vec<u8> {
        let mut state = 1u64;
        (0..len)
            .map(|_| {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                (state >> 60) as u8
            })
            .collect()
    }

    fn gzip(bytes: &[u8], portion: usize, threads: usize) -> Vec<u8> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut writer = GzipWriter::new(Vec::new()).unwrap();
            bytes.chunks(portion).for_each(|part| writer.write_all(part).unwrap());
            writer.finish().unwrap()
        })
    }

    #[test]
    fn output_is_one_member_that_a_plain_decoder_reads() {
        for len in [0, 1, BLOCK - 1, BLOCK, BLOCK + 1, BLOCK * (BATCH + 2) + 77] {
            let bytes = noise(len);
            let packed = gzip(&bytes, 300_001, 2);
            let mut decoder = flate2::bufread::GzDecoder::new(packed.as_slice());
            let mut back = Vec::new();
            decoder.read_to_end(&mut back).unwrap();
            assert!(back == bytes, "{len} bytes");
            assert!(decoder.into_inner().is_empty(), "there is more than one member");
        }
    }

    #[test]
    fn bytes_do_not_depend_on_threads_or_portions() {
        let bytes = noise(BLOCK * (BATCH + 3) + 5);
        let reference = gzip(&bytes, bytes.len(), 1);
        assert!(reference == gzip(&bytes, 77_777, 3));
        assert!(reference == gzip(&bytes, BLOCK, 8));
        assert!(reference != gzip(&bytes[1..], BLOCK, 1));
    }

    #[test]
    fn incompressible_bytes_survive() {
        let bytes: Vec<u8> =
            noise(BLOCK + 9).iter().zip(noise(2 * BLOCK)).map(|(a, b)| a << 4 ^ b.wrapping_mul(23)).collect();
        let mut back = Vec::new();
        flate2::bufread::GzDecoder::new(gzip(&bytes, BLOCK, 2).as_slice()).read_to_end(&mut back).unwrap();
        assert!(back == bytes);
    }
}
