//! Sweeps: many scans and many settings, each combination run once.
//!
//! A [`Study`] names scenes, scans and axes of settings. Its product and its explicit cases are
//! [`Case`]s. [`run_case`] runs one as [`run`](crate::run()) does, in a folder of its own, and adds
//! a line to the journal of the case. [`Folder::state`] compares journal, report and inputs, so
//! that a sweep that was interrupted or changed repeats only what it must. [`Table`] collects the
//! results.

mod cases;
mod folder;
mod identity;
mod journal;
mod name;
mod plots;
mod results;
mod run_case;
mod study;
mod table;

pub use cases::{Case, MAX_CASES};
pub use folder::{CaseState, Folder};
pub use identity::Hashes;
pub use journal::Entry;
pub use run_case::{Ran, record_death, run_case};
pub use study::{Axis, Study};
pub use table::Table;
