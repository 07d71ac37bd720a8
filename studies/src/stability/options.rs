//! Options of the study.

use std::path::PathBuf;

use clap::{Parser, ValueEnum};
use cutis_gpu::Select;

/// Runs the stability suite: stiff and extreme cases on every backend, at length scales 1e-3, 1 and
/// 1e3.
///
/// Each case has a requirement for its end. The exit code is 0 if every trial meets it, 1 if not, 2
/// for a wrong option.
#[derive(Clone, Debug, Default, Parser)]
#[command(name = "stability", bin_name = "cargo xtask study stability")]
pub struct Options {
    /// Fewer cases: about half a minute on two cores.
    #[arg(long)]
    pub quick: bool,
    /// All cases, one of them with a million steps.
    #[arg(long, conflicts_with = "quick")]
    pub full: bool,
    /// Only these backends; by default `reference` (f64, one thread), `cpu` (f32) and `gpu` (f32,
    /// every adapter).
    #[arg(long, value_enum, value_delimiter = ',')]
    pub backend: Vec<BackendName>,
    /// Only this adapter: its index, or a part of its name.
    #[arg(long, value_name = "NAME|INDEX", value_parser = |text: &str| text.parse::<Select>())]
    pub adapter: Option<Select>,
    /// Continue without a GPU if there is no adapter.
    #[arg(long)]
    pub allow_no_gpu: bool,
    /// Search for the states of rest of the bodies in place of running frames.
    #[arg(long, conflicts_with_all = ["backend", "adapter", "allow_no_gpu", "out", "json"])]
    pub rest: bool,
    /// Only this length scale.
    #[arg(long)]
    pub scale: Option<f64>,
    /// Write the tables of docs/results/stability.md.
    #[arg(long, conflicts_with_all = ["quick", "backend", "adapter", "scale", "case"])]
    pub write: bool,
    /// Write the page with its tables into this folder.
    #[arg(long, value_name = "FOLDER", conflicts_with = "write")]
    pub out: Option<PathBuf>,
    /// Write all trials and the provenance to this file.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Only cases whose name contains this.
    pub case: Option<String>,
}

/// A backend of the study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BackendName {
    /// `SolverReference<f64>`.
    Reference,
    /// `SolverCpu<f32>`.
    Cpu,
    /// `SolverGpu`.
    Gpu,
}

/// Number of cases to run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// Only the quick cases.
    Quick,
    /// All cases.
    Normal,
    /// All cases, one of them for a million steps.
    Full,
}

impl Options {
    /// The command line, as the page names it.
    pub fn command(&self) -> String {
        let flags = [
            (self.quick, " --quick"),
            (self.full, " --full"),
            (self.rest, " --rest"),
            (self.write, " --write"),
        ];
        let flags = flags.into_iter().filter(|(set, _)| *set).map(|(_, flag)| flag);
        "stability".to_owned() + &flags.collect::<String>()
    }

    /// Number of cases to run.
    pub fn effort(&self) -> Effort {
        match (self.quick, self.full) {
            (true, _) => Effort::Quick,
            (_, true) => Effort::Full,
            _ => Effort::Normal,
        }
    }

    /// True if this backend is to run.
    pub fn wants(&self, backend: BackendName) -> bool {
        self.backend.is_empty() || self.backend.contains(&backend)
    }
}
