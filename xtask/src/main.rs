//! Developer commands of the workspace, started by `cargo xtask`: run the tests, check the rules,
//! count lines, pack the crates. They install nothing and change nothing outside the checkout.

mod default_features;
mod examples;
mod leaving_out;
mod lines;
mod miri;
mod mutations;
mod parity;
mod publish;
mod python;
mod results;
mod steps;
mod tidy;
mod tools;
mod tuning;
mod unsafe_files;
mod vulkan;
mod workspace;

use std::process::ExitCode;

use anyhow::{Result, bail};
use mutations::Choice;
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
  python              compare outputs with nibabel and SimpleITK, and a bent beam with scikit-fem
  lines [--at REV]    count lines per tree and language, in the checkout or in a revision of git
  publish --dry-run   pack every crate as for crates.io and build it from its package
  cantilever          compare a bent beam with scikit-fem: docs/results/cantilever.md
  parity [OPTIONS]    the GPU backend compared with the CPU, operation by operation, on every adapter; `parity --help`
                      lists the options, and the exit code is that of the comparison
  parity-page         the same three ways, as it is, in small chunks and at full size: docs/results/parity.md
  stability [OPTIONS] stiff and extreme cases on every backend at three length scales; `stability --help` lists the options, with
                      --write: docs/results/stability.md; the exit code says whether every case ended as it must
  accuracy [OPTIONS]  error against run time, for each problem and setting, against direct solutions in f64; `accuracy --help`
                      lists the options, --write writes docs/results/accuracy.md
  chainmail [OPTIONS] ChainMail on scans, and beside position-based dynamics; --write writes docs/results/chainmail.md; the exit code
                      says whether all checks hold
  mutations [TEXT]    faults put in on purpose, in a copy of the last commit, each of which a test must see: docs/results/;
                      with a text only those whose description contains it, and nothing is written; with --suite NAME
                      those that one suite of tests must see, and only its section is written
  results             the main job on the phantom and the real volumes, with and without skin tension: docs/results/
  leaving-out         what a region or a graded lattice saves and costs, against the whole body: docs/results/
  tuning              `cutis tune` on the demo, and whether a full run keeps what it promises: docs/results/";

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

fn dispatch(words: &[&str]) -> Result<ExitCode> {
    let workspace = Workspace::find()?;
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
        ["lines"] => lines::run(&workspace, None),
        ["lines", "--at", revision] => lines::run(&workspace, Some(revision)),
        ["python"] => steps::build_for_python(&workspace).and_then(|()| python::run(&workspace)),
        ["cantilever"] => steps::cantilever(&workspace),
        ["parity", arguments @ ..] => {
            return workspace::exit_code(&mut steps::parity_command(&workspace, arguments));
        }
        ["stability", arguments @ ..] => {
            return workspace::exit_code(&mut steps::stability_command(&workspace, arguments));
        }
        ["accuracy", arguments @ ..] => {
            return workspace::exit_code(&mut steps::accuracy_command(&workspace, arguments));
        }
        ["chainmail", arguments @ ..] => {
            return workspace::exit_code(&mut steps::chainmail_command(&workspace, arguments));
        }
        ["parity-page"] => parity::run(&workspace),
        ["mutations"] => mutations::run(&workspace, Choice::All),
        ["mutations", "--suite", name] => mutations::run(&workspace, Choice::Suite(name)),
        ["mutations", text] => mutations::run(&workspace, Choice::Containing(text)),
        ["results"] => steps::build_program(&workspace).and_then(|()| results::run(&workspace)),
        ["leaving-out"] => steps::build_program(&workspace).and_then(|()| leaving_out::run(&workspace)),
        ["tuning"] => steps::build_program(&workspace).and_then(|()| tuning::run(&workspace)),
        ["publish", "--dry-run"] => publish::dry_run(&workspace),
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
