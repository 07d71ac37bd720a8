//! What the file formats share: bytes of a file, voxels of any real type, and compression.

mod convert;
mod data_file;
mod decode;
mod gzip;
mod put;
mod second_thread;
mod source;
mod text;

pub(crate) use convert::VoxelType;
pub(crate) use data_file::{data_file, require_file};
pub(crate) use decode::{Layout, Opened, decode, decode_raw};
pub(crate) use gzip::GzipWriter;
pub(crate) use put::{PutVoxels, fits_int16, put_hu};
pub(crate) use source::{Compression, Observer, Source, again};
pub(crate) use text::{header_error, lines, numbers, sizes};
