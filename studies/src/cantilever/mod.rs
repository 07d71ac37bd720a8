//! P8: a beam that is fixed at one end and bends under its own weight, compared with an independent
//! FEM.
//!
//! The beam is square, four times as long as thick, on a `kuhn6` lattice of `cutis-mesh` along x;
//! gravity is along −y. Its state of rest is a minimum of an energy. Newton's method
//! (`cutis-newton`), finite elements (`tests/python`) and the solver with short substeps must
//! therefore agree. With the few substeps of real-time settings the solver differs, and the study
//! measures how much.

mod beam;
mod cases;
mod document;
mod settle;
mod tables;

use std::io::Write;
use std::path::PathBuf;

use anyhow::bail;
use clap::Parser;

pub use beam::{Beam, Failure, GRAVITY_M_S2, Material};
pub use cases::{BeamCase, real_time};
pub use document::Document;
pub use settle::{Rest, Stepping, converged, settle};
pub use tables::TABLES;

use crate::kit::{Provenance, write_json};

/// Bends beams for the independent FEM, and makes the tables of the page from its comparison.
///
/// `cargo xtask study cantilever` runs both parts and tests/python/cantilever.py between them.
#[derive(Clone, Debug, Parser)]
#[command(name = "cantilever", bin_name = "cargo xtask study cantilever")]
pub struct Options {
    /// Only the cases of the tests: the coarse beam, no real-time settings, no GPU.
    #[arg(long, requires = "beams")]
    pub quick: bool,
    /// Bend the beams and write the results to this file, for tests/python/cantilever.py.
    #[arg(long, value_name = "FILE")]
    pub beams: Option<PathBuf>,
    /// Write the tables of docs/results/cantilever.md from this file of tests/python/cantilever.py.
    #[arg(long, value_name = "FILE", conflicts_with = "beams")]
    pub compared: Option<PathBuf>,
}

/// Bends the beams or writes the tables.
///
/// # Errors
/// Newton's method does not converge, a device fails, or a file cannot be read or written.
pub fn run(options: &Options, _: &mut dyn Write) -> Result<bool, Failure> {
    match (&options.beams, &options.compared) {
        (Some(path), _) => write_json(path, &Document::new(options.quick)?)?,
        (None, Some(path)) => tables::write(path, Provenance::start("cantilever"))?,
        (None, None) => bail!("`--beams FILE` or `--compared FILE` is needed"),
    }
    Ok(true)
}
