//! Tests of volume files and the phantom, against other programs, closed forms and damaged input.

mod awkward;
#[cfg(feature = "dicom")]
mod dicom;
mod hostile;
mod labels;
mod outside;
mod phantom;
mod round_trip;
mod text_formats;
