//! What the user asks for.

use std::path::PathBuf;

use clap::Parser;

use super::cases::NAMES;

/// Measures error against run time, against a direct solution in f64 that uses none of the solver's code.
///
/// Every configuration (backend, formulation, substeps × iterations) of every problem is timed, and in the same run compared
/// with the minimizer of its implicit step (E1), with a run of at least 64 times the substeps (E2), and with the equilibrium
/// (E3, E4). The exit code is 0 if the checks hold, 1 if not, 2 for a wrong option.
#[derive(Clone, Debug, Default, Parser)]
#[command(name = "accuracy", bin_name = "cargo xtask accuracy")]
pub struct Options {
    /// Small problems and few configurations: about half a minute on two cores.
    #[arg(long)]
    pub quick: bool,
    /// Only this problem.
    #[arg(long, value_name = "P", value_parser = NAMES)]
    pub problem: Option<String>,
    /// Try accelerations instead: how many sweeps a substep takes with each, on the incision and the block unless told which problem.
    #[arg(long)]
    pub trials: bool,
    /// Write the page docs/results/accuracy.md, its table accuracy.csv and its charts; with --trials accelerations.md and its table.
    /// Only for all problems at full size.
    #[arg(long, conflicts_with_all = ["quick", "problem", "out"])]
    pub write: bool,
    /// Write page, table and charts into this folder.
    #[arg(long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// Leave the GPU out.
    #[arg(long)]
    pub no_gpu: bool,
}

impl Options {
    /// The command line, as the page names it.
    pub fn command(&self) -> String {
        let mut words = vec!["cargo xtask accuracy".to_owned()];
        words.extend(self.quick.then(|| "--quick".to_owned()));
        words.extend(self.trials.then(|| "--trials".to_owned()));
        words.extend(self.problem.iter().map(|name| format!("--problem {name}")));
        words.extend(self.write.then(|| "--write".to_owned()));
        words.extend(self.out.iter().map(|folder| format!("--out {}", folder.display())));
        words.extend(self.no_gpu.then(|| "--no-gpu".to_owned()));
        words.join(" ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_read() {
        let options = Options::try_parse_from(["accuracy", "--quick", "--problem", "sheet"]).unwrap();
        assert_eq!(options.command(), "cargo xtask accuracy --quick --problem sheet");
        for wrong in
            [&["--problem", "sheep"][..], &["--quick", "--write"], &["--write", "--problem", "block"]]
        {
            let words = std::iter::once("accuracy").chain(wrong.iter().copied());
            assert_eq!(Options::try_parse_from(words).unwrap_err().exit_code(), 2, "{wrong:?}");
        }
    }
}
