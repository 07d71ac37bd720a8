//! What the user asks for.

use clap::{Parser, ValueEnum};
use cutis_gpu::Select;

/// Runs the stability suite: stiff and extreme cases on every backend, at length scales 1e-3, 1 and 1e3.
///
/// Each case says what must hold at its end. The exit code is 0 if every row ended as it must, 1 if not, 2 for a wrong option.
#[derive(Clone, Debug, Default, Parser)]
#[command(name = "stability", bin_name = "cargo xtask stability")]
pub struct Options {
    /// Fewer cases: about half a minute on two cores.
    #[arg(long)]
    pub quick: bool,
    /// Also a million steps.
    #[arg(long, conflicts_with = "quick")]
    pub full: bool,
    /// Only these backends; by default `reference` (f64, one thread), `cpu` (f32) and `gpu` (f32, every adapter).
    #[arg(long, value_enum, value_delimiter = ',')]
    pub backend: Vec<BackendName>,
    /// Only this adapter: its index, or a part of its name.
    #[arg(long, value_name = "NAME|INDEX", value_parser = |text: &str| text.parse::<Select>())]
    pub adapter: Option<Select>,
    /// Leave the GPU out where there is no adapter.
    #[arg(long)]
    pub allow_no_gpu: bool,
    /// Only this length scale.
    #[arg(long)]
    pub scale: Option<f64>,
    /// Write docs/results/stability.md and stability.csv.
    #[arg(long, conflicts_with_all = ["quick", "backend", "adapter", "scale", "case"])]
    pub write: bool,
    /// Only cases whose name contains this.
    pub case: Option<String>,
}

/// What a case is run on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BackendName {
    /// `SolverReference<f64>`.
    Reference,
    /// `SolverCpu<f32>`.
    Cpu,
    /// `SolverGpu`.
    Gpu,
}

/// How much is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// The quick cases.
    Quick,
    /// All cases.
    Normal,
    /// All cases, one of them for a million steps.
    Full,
}

impl Options {
    /// How much is run.
    pub fn effort(&self) -> Effort {
        match (self.quick, self.full) {
            (true, _) => Effort::Quick,
            (_, true) => Effort::Full,
            _ => Effort::Normal,
        }
    }

    /// Whether this backend is asked for.
    pub fn wants(&self, backend: BackendName) -> bool {
        self.backend.is_empty() || self.backend.contains(&backend)
    }
}
