//! How many bytes the compressed parts of an input unpack to, counted without the readers under
//! test. The memory that a reader may take grows with them.

use std::io::{self, Read};

use flate2::read::{DeflateDecoder, MultiGzDecoder, ZlibDecoder};

/// Bytes that any compressed stream in the input unpacks to.
pub(crate) fn unpacked_bytes(input: &[u8]) -> usize {
    let find = |mark: &[u8]| input.windows(mark.len()).position(|part| part == mark);
    let gzip = find(&[0x1f, 0x8b, 8]).map_or(0, |at| count(MultiGzDecoder::new(&input[at..])));
    let zlib = [1, 0x5e, 0x9c, 0xda].into_iter().filter_map(|level| find(&[0x78, level]));
    let zlib = zlib.map(|at| count(ZlibDecoder::new(&input[at..]))).max().unwrap_or(0);
    // The data set of a deflated DICOM file begins somewhere in the first kilobyte.
    let deflated = find(b"1.2.840.10008.1.2.1.99").map_or(0, |at| {
        let starts = at..(at + 400).min(input.len());
        starts.map(|at| count(DeflateDecoder::new(&input[at..]))).max().unwrap_or(0)
    });
    gzip.max(zlib).max(deflated)
}

/// Bytes up to the end or to the first error.
fn count(mut stream: impl Read) -> usize {
    let mut buffer = [0; 1 << 12];
    let mut total = 0;
    loop {
        match stream.read(&mut buffer) {
            Ok(0) => return total,
            Ok(bytes) => total += bytes,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(_) => return total,
        }
    }
}
