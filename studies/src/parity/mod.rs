//! Parity: the GPU backend against the CPU backend in `f32`, on every adapter of the machine, in
//! three rings.
//!
//! | ring | compares | with |
//! |---|---|---|
//! | op | value and gradients of each constraint, by the checks of `cutis-conformance` | `f64` and `f32` on the CPU |
//! | kernel | one pass of each kernel | the CPU backend, or the scalar twin |
//! | scene | whole runs of the pipeline; conserved quantities of long runs | the same run on the CPU |
//!
//! Every comparison has controls: the same comparison with a deliberate fault. A control that
//! passes is a failure, and so is an expected failure ([`EXPECTED`]) that passes. The [`Policy`] of
//! an adapter is the largest allowed difference.

mod bench;
mod bodies;
mod comparison;
mod difference;
mod expected;
mod full_size;
mod json;
mod kernel;
mod log;
mod op;
mod options;
mod page;
mod scene;

use std::io::Write;

use cutis_gpu::{Adapter, Gpu, GpuError, GpuOptions, Select};

pub use bench::{Bench, Effort, Failure};
pub use comparison::{Comparison, Figures, Measured, Ring, Verdict};
pub use difference::{Difference, Policy, TOLERANCE};
pub use expected::{EXPECTED, ExpectedFailure};
pub use options::Options;
pub use page::TABLES;

use crate::kit::write_json;
use json::Document;
use log::Log;

/// Rings of a run. Each must have compared something.
const RINGS: [Ring; 3] = [Ring::Op, Ring::Kernel, Ring::Scene];

/// Compares, prints every comparison to `out`, and writes the file of [`Options::json`]. Returns
/// whether every comparison has the required verdict. With [`Options::write`] it runs three times
/// and writes the page instead.
///
/// # Errors
/// There is no adapter and that is not allowed, an adapter cannot be opened, or a file cannot be
/// written.
pub fn run(options: &Options, out: &mut dyn Write) -> Result<bool, Failure> {
    if options.write {
        return page::write().map(|()| true);
    }
    let adapters = wanted(options)?;
    let mut log = Log::new(out, EXPECTED);
    for adapter in &adapters {
        let policy = Policy::of(adapter);
        let (index, name, kind, driver) = (adapter.index, &adapter.name, adapter.kind, &adapter.driver);
        log.line(&format!("{index}: {name} ({kind}, {}, {driver}): {}\n", adapter.api, policy.describe()))?;
        let gpu = Gpu::open(&GpuOptions {
            select: Select::Index(index),
            baseline_limits: options.baseline_limits || options.full_size,
            chunk_cap: options.chunk_cap,
            timestamps: false,
        })?;
        let mut bench = Bench { gpu, policy, effort: effort(options), log: &mut log };
        if options.full_size {
            full_size::run(&mut bench)?;
        } else {
            op::run(&mut bench)?;
            kernel::run(&mut bench)?;
            scene::run(&mut bench)?;
        }
    }
    let (rows, passed) = if adapters.is_empty() {
        log.line(&format!("nothing compared: {}", GpuError::NoAdapter))?;
        (Vec::new(), true)
    } else {
        log.finish(if options.full_size { &[Ring::FullSize] } else { &RINGS })?
    };
    if let Some(path) = &options.json {
        write_json(path, &Document::new(options, &adapters, &rows, passed))?;
    }
    Ok(passed)
}

/// The adapters to compare. Empty only if that is allowed and no adapter is named.
fn wanted(options: &Options) -> Result<Vec<Adapter>, GpuError> {
    choose(cutis_gpu::adapters(), options)
}

fn choose(all: Vec<Adapter>, options: &Options) -> Result<Vec<Adapter>, GpuError> {
    if all.is_empty() {
        return if options.allow_no_gpu && options.adapter.is_none() {
            Ok(all)
        } else {
            Err(GpuError::NoAdapter)
        };
    }
    match &options.adapter {
        Some(select) => Ok(vec![select.among(&all)?.clone()]),
        None => Ok(all),
    }
}

fn effort(options: &Options) -> Effort {
    match (options.quick, options.full) {
        (true, _) => Effort::Quick,
        (_, true) => Effort::Full,
        _ => Effort::Normal,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_adapter_is_an_error_unless_it_is_allowed() {
        let error = choose(Vec::new(), &Options::default()).unwrap_err();
        assert!(error.to_string().contains("mesa-vulkan-drivers"), "{error}");
        let options = Options { allow_no_gpu: true, ..Options::default() };
        assert_eq!(choose(Vec::new(), &options), Ok(Vec::new()));
        let options = Options { adapter: Some(Select::Name("nvidia".into())), ..options };
        assert!(choose(Vec::new(), &options).is_err(), "a named adapter must exist");
    }

    #[test]
    fn no_comparison_is_expected_to_fail() {
        assert!(EXPECTED.is_empty(), "each needs a reason and a plan to remove it");
    }
}
