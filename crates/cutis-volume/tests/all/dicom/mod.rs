//! CT series in DICOM files that these tests write, and in real ones.

mod choice;
mod enhanced;
mod file;
mod geometry;
mod hostile;
mod real;
mod values;
