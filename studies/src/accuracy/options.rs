//! Options of the study.

use std::path::PathBuf;

use clap::Parser;

use super::problems::NAMES;

/// Measures error against run time. The reference is a direct solution in f64 that shares no code
/// with the solver.
///
/// Each configuration (backend, formulation, substeps × iterations) of each problem is timed. In
/// the same run its results are compared with the minimizer of the implicit step (E1), with a run
/// of at least 64 times the substeps (E2), and with the equilibrium (E3, E4). The exit code is 0 if
/// all checks hold, 1 if not, 2 for a wrong option.
#[derive(Clone, Debug, Default, Parser)]
#[command(name = "accuracy", bin_name = "cargo xtask study accuracy")]
pub struct Options {
    /// Small problems and few configurations: about half a minute on two cores.
    #[arg(long)]
    pub quick: bool,
    /// Only this problem.
    #[arg(long, value_name = "P", value_parser = NAMES)]
    pub problem: Option<String>,
    /// Measure the problem `membrane` instead, which has its own part of the page. It takes
    /// minutes.
    #[arg(long, conflicts_with = "problem")]
    pub membrane: bool,
    /// Write the tables and charts of docs/results/accuracy.md: the main part, or with --membrane
    /// its part. Only for problems at full size.
    #[arg(long, conflicts_with_all = ["quick", "problem", "out"])]
    pub write: bool,
    /// Write the page with its tables, all charts and accuracy.csv into this folder.
    #[arg(long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// Write all measurements and the provenance to this file.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Do not use a GPU.
    #[arg(long)]
    pub no_gpu: bool,
}

impl Options {
    /// The command line, as the page names it.
    pub fn command(&self) -> String {
        let mut words = vec!["accuracy".to_owned()];
        words.extend(self.quick.then(|| "--quick".to_owned()));
        words.extend(self.membrane.then(|| "--membrane".to_owned()));
        words.extend(self.problem.iter().map(|name| format!("--problem {name}")));
        words.extend(self.write.then(|| "--write".to_owned()));
        words.extend(self.no_gpu.then(|| "--no-gpu".to_owned()));
        words.join(" ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_parsed() {
        let options = Options::try_parse_from(["accuracy", "--quick", "--problem", "sheet"]).unwrap();
        assert_eq!(options.command(), "accuracy --quick --problem sheet");
        for wrong in [
            &["--problem", "sheep"][..],
            &["--quick", "--write"],
            &["--write", "--problem", "block"],
            &["--membrane", "--problem", "block"],
        ] {
            let words = std::iter::once("accuracy").chain(wrong.iter().copied());
            assert_eq!(Options::try_parse_from(words).unwrap_err().exit_code(), 2, "{wrong:?}");
        }
    }
}
