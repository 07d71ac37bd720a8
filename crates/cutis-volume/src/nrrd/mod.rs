//! NRRD files: `.nrrd`, and a `.nhdr` header with a file of voxels next to it.
//!
//! The format is defined at <https://teem.sourceforge.net/nrrd/format.html>.

mod header;
mod read;
mod vectors;
mod write;

pub use read::read;
pub use vectors::VectorWriter;
pub use write::write;

pub(crate) use read::{read_files, with_open};
pub(crate) use write::write_voxels;

/// The first bytes of a file.
pub(crate) const MAGIC: &[u8] = b"NRRD000";
