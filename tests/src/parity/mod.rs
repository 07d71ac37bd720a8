//! Parity: the GPU backend against the CPU's `f32`, on every adapter of the machine, in three rings.
//!
//! | ring | compares | with |
//! |---|---|---|
//! | op | value and gradients of each constraint, by the checks of `cutis-conformance` | `f64` and `f32` on the CPU |
//! | kernel | one pass of each kernel | the CPU backend, or the scalar twin |
//! | scene | whole runs of the pipeline, long runs by what they must preserve | the same run on the CPU |
//!
//! Every comparison has controls: the same comparison, with something wrong on purpose. A control that passes is a
//! failure, and so is an expected failure ([`EXPECTED`]) that passes. What an adapter is held to is its [`Policy`].

mod bench;
mod bodies;
mod difference;
mod expected;
mod full_size;
mod json;
mod kernel;
mod op;
mod options;
mod outcome;
mod scene;
mod table;

use std::io::Write;

use cutis_gpu::{Adapter, Gpu, GpuError, GpuOptions, Select};

pub use bench::{Bench, Effort, Failure};
pub use difference::{Difference, Policy, TOLERANCE};
pub use expected::{EXPECTED, ExpectedFailure};
pub use options::Options;
pub use outcome::{Figures, Measured, Outcome, Ring, Row};

use json::Document;
use table::Table;

/// Rings that a run goes through, of which each must have compared something.
const RINGS: [Ring; 3] = [Ring::Op, Ring::Kernel, Ring::Scene];

/// Compares, prints the table to `out` and writes the file of [`Options::json`]; whether every row is what it had to be.
///
/// # Errors
/// No adapter, unless that is allowed; an adapter that is not there or cannot be opened; the terminal's and the file's.
pub fn run(options: &Options, out: &mut dyn Write) -> Result<bool, Failure> {
    let adapters = wanted(options)?;
    let mut table = Table::new(out, EXPECTED);
    for adapter in &adapters {
        let policy = Policy::of(adapter);
        let (index, name, kind, driver) = (adapter.index, &adapter.name, adapter.kind, &adapter.driver);
        table.line(&format!(
            "{index}: {name} ({kind}, {}, {driver}): {}\n",
            adapter.api,
            policy.describe()
        ))?;
        let gpu = Gpu::open(&GpuOptions {
            select: Select::Index(index),
            baseline_limits: options.baseline_limits || options.full_size,
            chunk_cap: options.chunk_cap,
            timestamps: false,
        })?;
        let mut bench = Bench { gpu, policy, effort: effort(options), table: &mut table };
        if options.full_size {
            full_size::run(&mut bench)?;
        } else {
            op::run(&mut bench)?;
            kernel::run(&mut bench)?;
            scene::run(&mut bench)?;
        }
    }
    let (rows, passed) = if adapters.is_empty() {
        table.line(&format!("nothing compared: {}", GpuError::NoAdapter))?;
        (Vec::new(), true)
    } else {
        table.finish(if options.full_size { &[Ring::FullSize] } else { &RINGS })?
    };
    if let Some(path) = &options.json {
        Document::new(options, &adapters, &rows, passed).write(path)?;
    }
    Ok(passed)
}

/// The adapters to compare; none only where that is allowed and no adapter is named.
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
        assert!(choose(Vec::new(), &options).is_err(), "an adapter that is named has to be there");
    }

    #[test]
    fn nothing_is_expected_to_fail() {
        assert!(EXPECTED.is_empty(), "each has a reason here, and an issue that will remove it");
    }
}
