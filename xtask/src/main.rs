//! Developer commands of the workspace, started by `cargo xtask`: run the tests, check the rules,
//! count lines, pack the crates. They install nothing and change nothing outside the checkout.

mod book;
mod default_features;
mod examples;
mod installed;
mod lanes;
mod lines;
mod miri;
mod publish;
mod python;
mod static_program;
mod steps;
mod tidy;
mod tools;
mod unsafe_files;
mod vulkan;
mod workspace;

use std::process::ExitCode;

use anyhow::{Result, bail};
use steps::Selection;
use workspace::Workspace;

const USAGE: &str = "\
usage: cargo xtask COMMAND

  test                run all tests and checks; a change must pass them
  test --quick        run only the quick steps, and list the steps that were skipped
  test --only STEP    run one step
  test --list         print the names of the steps
  ci                  as `test`, with CI=true: no test may be skipped, lock files must be current
  tidy [--all]        check the rules of sources, manifests and pages; --all also where a rule is not
                      in force yet
  licenses            check licenses, bans and sources of all dependencies with cargo-deny
  python              compare inputs and outputs with nibabel, pydicom, pynrrd and SimpleITK, a bent
                      beam with scikit-fem, and the workflow of Snakemake with `cutis sweep`
  book                build the book as a site in target/book, and check its links
  fuzz [OPTIONS]      try damaged and hostile inputs with every reader; `fuzz --help` lists the options
  lines [--at REV]    count lines per tree and language, in the checkout or in a revision of git
  publish --dry-run   pack every crate as for crates.io, build it from its package, install the
                      program from its package and run it
  static              build a program for Linux that needs no file of the system, and run it in an
                      empty root folder; without GPUs
  study NAME [OPTIONS]
                      run a study; `study NAME --help` lists its options. With --write it writes its
                      tables and charts into docs/results/NAME.md:
      accuracy        error against run time for each problem and setting
      stability       stiff and extreme cases on every backend at three length scales
      parity          the GPU backend and the CPU backend, operation by operation
      patch           skin tension on the staircase of a plane and in a sheet; writes into tension.md
      at-rest         ways to hold the scan at rest; with --scans, how far the skin of scans moves
      cantilever      a bent beam and scikit-fem; always writes its page
      chainmail       ChainMail on scans, and position-based dynamics
      closing         what opens a cut, and the force of sutures that close an excision
      inputs          volumes that are read or refused, with the message; needs the test data
      instructions    instructions of the inner loops per constraint, with limits; needs Valgrind
      main-job        the main job on the phantom and on real scans, with and without skin tension
      region          cost and error of a region of interest and of a graded lattice
      rest            the search for the state of rest on bodies of all sizes, and frames of the demo
      tuning          `cutis tune` on the demo, compared with a full run
      peers           the speed of other programs on the same beam; needs PyPI the first time
      pictures        the main job on real scans with the paper's skin tension and with the membrane
      wound           frames of the demo without a cut, with one, and while it grows
      mutations       deliberate faults that a test must see
  accuracy, stability, parity, cantilever, chainmail [OPTIONS]
                      short for `study NAME`
  results, leaving-out, tuning, parity-page, mutations [--suite NAME]
                      short for `study NAME --write` with the names main-job, region, tuning,
                      parity and mutations; `mutations TEXT` tries only the faults with this text";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match dispatch(&words) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("\nerror: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// The study that a command starts, with its options.
fn study<'a>(words: &[&'a str]) -> Option<(&'a str, Vec<&'a str>)> {
    Some(match words {
        ["study", name, options @ ..] => (name, options.to_vec()),
        [name @ ("accuracy" | "stability" | "parity" | "cantilever" | "chainmail"), options @ ..] => {
            (name, options.to_vec())
        }
        ["results"] => ("main-job", vec!["--write"]),
        ["leaving-out"] => ("region", vec!["--write"]),
        ["tuning"] => ("tuning", vec!["--write"]),
        ["parity-page"] => ("parity", vec!["--write"]),
        ["mutations"] => ("mutations", vec!["--write"]),
        ["mutations", "--suite", suite] => ("mutations", vec!["--suite", suite, "--write"]),
        ["mutations", options @ ..] => ("mutations", options.to_vec()),
        _ => return None,
    })
}

fn dispatch(words: &[&str]) -> Result<ExitCode> {
    let workspace = Workspace::find()?;
    if let Some((name, options)) = study(words) {
        return match (name, &options[..]) {
            ("cantilever", []) => steps::cantilever(&workspace).map(|()| ExitCode::SUCCESS),
            ("peers", options) => steps::peers(&workspace, options),
            _ => workspace::exit_code(&mut steps::study_command(&workspace, name, &options)),
        };
    }
    match words {
        ["test"] => steps::run_all(&workspace, Selection::All),
        ["test", "--quick"] => steps::run_all(&workspace, Selection::Quick),
        ["test", "--list"] => {
            println!("{}", steps::names().join("\n"));
            Ok(())
        }
        ["test", "--only", step] => steps::run_all(&workspace, Selection::Only(step)),
        ["ci"] => steps::run_all(&workspace.in_ci(), Selection::All),
        ["tidy"] => tidy::run(&workspace),
        ["tidy", "--all"] => tidy::check(&workspace, true),
        ["licenses"] => steps::run_all(&workspace, Selection::Only("licenses")),
        ["book"] => book::run(&workspace),
        ["lines"] => lines::run(&workspace, None),
        ["lines", "--at", revision] => lines::run(&workspace, Some(revision)),
        ["python"] => steps::build_for_python(&workspace).and_then(|()| python::run(&workspace)),
        ["fuzz", options @ ..] => {
            return workspace::exit_code(&mut steps::fuzz_command(&workspace, options)?);
        }
        ["publish", "--dry-run"] => publish::dry_run(&workspace),
        ["static"] => static_program::run(&workspace),
        ["publish"] => bail!(
            "`cargo xtask` only offers `publish --dry-run`; make a release with `cargo publish --workspace`"
        ),
        [] | ["help" | "--help" | "-h"] => {
            println!("{USAGE}");
            Ok(())
        }
        other => bail!("unknown command `{}`\n\n{USAGE}", other.join(" ")),
    }
    .map(|()| ExitCode::SUCCESS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_commands_start_the_same_studies() {
        assert_eq!(study(&["study", "parity", "--quick"]), study(&["parity", "--quick"]));
        assert_eq!(study(&["results"]), Some(("main-job", vec!["--write"])));
        assert_eq!(study(&["mutations", "sign"]), Some(("mutations", vec!["sign"])));
        assert_eq!(study(&["mutations"]), study(&["study", "mutations", "--write"]));
        assert_eq!(study(&["test"]), None);
    }
}
