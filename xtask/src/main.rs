//! Developer commands of the workspace, started by `cargo xtask`: the tests, the checks they consist of, and nothing else.

mod deny;
mod leaving_out;
mod mutations;
mod parity;
mod publish;
mod python;
mod results;
mod spdx;
mod steps;
mod tidy;
mod tuning;
mod vulkan;
mod workspace;

use std::process::ExitCode;

use anyhow::{Result, bail};
use mutations::Choice;
use workspace::Workspace;

const USAGE: &str = "\
usage: cargo xtask COMMAND

  test [--quick]      everything a change must pass; --quick leaves out the slow steps and lists them
  ci                  the same with CI=true: nothing may be skipped, the lock files must be up to date
  tidy                layers, file headers, unsafe, shaders, paths named in the docs, links, manifests
  licenses            licenses, bans and sources of every dependency, by deny.toml
  python              outputs and awkward inputs compared with nibabel and SimpleITK, a bent beam with scikit-fem
  cantilever          a bent beam at rest and in real time compared with scikit-fem: docs/results/cantilever.md
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
  tuning              `cutis tune` on the demo, and whether a full run keeps what it promises: docs/results/
  publish --dry-run   packages every crate as for crates.io and builds it from the package";

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
        ["test"] => steps::run_all(&workspace, false),
        ["test", "--quick"] => steps::run_all(&workspace, true),
        ["ci"] => steps::run_all(&workspace.in_ci(), false),
        ["tidy"] => tidy::run(&workspace),
        ["licenses"] => deny::run(&workspace),
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
            "only `cargo xtask publish --dry-run` is offered; a release is made by `cargo publish --workspace`"
        ),
        [] | ["help" | "--help" | "-h"] => {
            println!("{USAGE}");
            Ok(())
        }
        other => bail!("unknown command `{}`\n\n{USAGE}", other.join(" ")),
    }
    .map(|()| ExitCode::SUCCESS)
}
