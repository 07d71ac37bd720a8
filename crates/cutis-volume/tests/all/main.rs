//! Tests of NIfTI files and the phantom, against other programs, closed forms and damaged input.

mod awkward;
mod hostile;
mod phantom;
mod round_trip;
