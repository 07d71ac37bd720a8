//! MetaImage files: `.mha`, and a `.mhd` header with a file of voxels next to it.
//!
//! The format is that of ITK: <https://docs.itk.org/en/latest/learn/metaio.html>.

mod header;
mod read;
mod write;

pub use read::read;
pub use write::write;

pub(crate) use read::{is_metaimage, read_files, with_open};
pub(crate) use write::write_voxels;
