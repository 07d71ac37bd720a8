//! CT series in DICOM files.
//!
//! The libraries `dicom-object` and `dicom-pixeldata` parse files and decompress pixels to stored
//! values. Choice of the series, order of the slices, checks of their geometry, and HU are here.
//! Names, dates and identifiers of a patient appear in no message.

mod codestream;
mod error;
mod file;
mod frames;
mod lengths;
mod list;
mod pixels;
mod read;
mod series;
mod slice;
mod stack;
mod tags;

pub use error::{DicomError, SliceSource};
pub use list::{Listing, SeriesInfo, list};

pub(crate) use file::is_dicom;
pub(crate) use read::read_series;
