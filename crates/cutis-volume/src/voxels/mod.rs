//! What the file formats share: bytes of a file, voxels of any real type, and compression.

mod convert;
mod decode;
mod gzip;
mod source;

pub(crate) use convert::VoxelType;
pub(crate) use decode::{Layout, decode};
pub(crate) use gzip::GzipWriter;
pub(crate) use source::{Compression, Observer, Source, again};
