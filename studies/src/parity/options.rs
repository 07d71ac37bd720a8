//! Options of the study.

use std::path::PathBuf;

use clap::Parser;
use cutis_gpu::Select;
use serde::Serialize;

/// Compares the GPU backend with the CPU backend in `f32`, on every adapter of the machine.
///
/// There are three rings: single constraints (op), single passes on the device (kernel), and whole
/// runs (scene). On software adapters every number has to be equal. Hardware may fuse a product
/// with a sum and has a tolerance. Every comparison has controls: the same comparison with a
/// deliberate fault, which it must reject. The exit code is 0 if every comparison has the required
/// verdict, 1 if not or without an adapter, 2 for a wrong option.
#[derive(Clone, Debug, Default, Parser, Serialize)]
#[command(name = "parity", bin_name = "cargo xtask study parity")]
pub struct Options {
    /// Fewer frames and smaller scenes: about half a minute on two cores.
    #[arg(long)]
    pub quick: bool,
    /// Also the demo at full size, which takes long on a software adapter.
    #[arg(long, conflicts_with = "quick")]
    pub full: bool,
    /// Instead of the rings: one step of a lattice of 129 × 129 × 289 vertices with three kinds of
    /// constraints, within WebGPU's baseline limits. Needs about 3 GiB of memory. On a software
    /// adapter this includes the memory of the device.
    #[arg(long, conflicts_with_all = ["quick", "full", "chunk_cap"])]
    pub full_size: bool,
    /// Run with default limits, in small chunks and at full size, and write the tables of
    /// docs/results/parity.md.
    #[arg(long, exclusive = true)]
    #[serde(skip)]
    pub write: bool,
    /// Write all comparisons to this file.
    #[arg(long, value_name = "FILE")]
    #[serde(skip)]
    pub json: Option<PathBuf>,
    /// Succeed if there is no adapter.
    #[arg(long)]
    pub allow_no_gpu: bool,
    /// Only this adapter: its index, or a part of its name.
    #[arg(long, value_name = "NAME|INDEX", value_parser = |text: &str| text.parse::<Select>())]
    #[serde(serialize_with = "as_text")]
    pub adapter: Option<Select>,
    /// Largest number of items in a chunk, so that colors are split. Small chunks need many
    /// dispatches and take long.
    #[arg(long, value_name = "N", value_parser = at_least_one)]
    pub chunk_cap: Option<usize>,
    /// Request exactly the default limits of WebGPU from the device.
    #[arg(long)]
    pub baseline_limits: bool,
}

fn at_least_one(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(0) | Err(_) => Err("a chunk has 1 item or more".into()),
        Ok(n) => Ok(n),
    }
}

fn as_text<S: serde::Serializer>(adapter: &Option<Select>, serializer: S) -> Result<S::Ok, S::Error> {
    adapter.as_ref().map(ToString::to_string).serialize(serializer)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_parsed() {
        let options = Options::try_parse_from(["parity", "--quick", "--adapter", "llvm", "--chunk-cap", "7"]);
        let options = options.unwrap();
        assert_eq!(options.adapter, Some(Select::Name("llvm".into())));
        assert_eq!((options.quick, options.chunk_cap), (true, Some(7)));
        for wrong in
            [&["--chunk-cap", "0"][..], &["--quick", "--full"], &["--full-size", "--quick"], &["--fast"]]
        {
            let words = std::iter::once("parity").chain(wrong.iter().copied());
            assert_eq!(Options::try_parse_from(words).unwrap_err().exit_code(), 2, "{wrong:?}");
        }
    }
}
