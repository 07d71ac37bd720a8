//! The steps of `cargo xtask test`, in order and timed. The first failure ends the run.

use std::process::{Command, ExitCode};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};

use crate::workspace::{Workspace, execute, exit_code};
use crate::{book, default_features, examples, lanes, miri, publish, python, tidy, tools, vulkan};

struct Step {
    name: &'static str,
    /// Also part of `--quick`.
    quick: bool,
    run: fn(&Workspace) -> Result<()>,
}

const STEPS: &[Step] = &[
    Step { name: "format", quick: true, run: format },
    Step { name: "tidy", quick: true, run: tidy::run },
    Step { name: "licenses", quick: true, run: licenses },
    Step { name: "xtask", quick: true, run: xtask },
    Step { name: "clippy", quick: true, run: clippy },
    Step { name: "tests", quick: true, run: tests },
    Step { name: "lanes", quick: false, run: lanes::run },
    Step { name: "examples", quick: false, run: examples::run },
    Step { name: "no-default-features", quick: false, run: default_features::run },
    Step { name: "third-party", quick: false, run: third_party },
    Step { name: "parity", quick: false, run: parity },
    Step { name: "fuzz", quick: false, run: fuzz_briefly },
    Step { name: "instructions", quick: false, run: instructions },
    Step { name: "miri", quick: false, run: miri::run },
    Step { name: "documentation", quick: false, run: documentation },
    Step { name: "book", quick: false, run: book::run },
    Step { name: "python", quick: false, run: python::run },
    Step { name: "publish", quick: false, run: publish::pack },
];

/// Which steps to run.
#[derive(Clone, Copy, PartialEq)]
pub enum Selection<'a> {
    All,
    Quick,
    Only(&'a str),
}

impl Selection<'_> {
    fn includes(self, step: &Step) -> bool {
        match self {
            Self::All => true,
            Self::Quick => step.quick,
            Self::Only(name) => step.name == name,
        }
    }
}

/// The names of all steps, in order.
pub fn names() -> Vec<&'static str> {
    STEPS.iter().map(|step| step.name).collect()
}

/// Runs the selected steps and prints the result and the time of each.
///
/// # Errors
/// A tool is missing, a step failed, or the selection is not valid.
pub fn run_all(workspace: &Workspace, selection: Selection<'_>) -> Result<()> {
    match selection {
        Selection::Quick if workspace.ci => {
            bail!("`--quick` skips steps, and CI is set: run `cargo xtask test`")
        }
        Selection::Only(name) if !names().contains(&name) => {
            bail!("there is no step `{name}`; the steps are {}", names().join(", "))
        }
        Selection::Only(_) => {}
        Selection::All | Selection::Quick => tools::require(workspace, selection == Selection::All)?,
    }
    let start = Instant::now();
    let mut results = Vec::new();
    let mut failure = None;
    for (number, step) in STEPS.iter().enumerate().filter(|(_, step)| selection.includes(step)) {
        if failure.is_some() {
            results.push((step.name, "not reached", None));
            continue;
        }
        println!("\n=== {}/{} {}", number + 1, STEPS.len(), step.name);
        let step_start = Instant::now();
        let result = (step.run)(workspace).with_context(|| format!("step `{}` failed", step.name));
        let time = step_start.elapsed();
        results.push((step.name, if result.is_ok() { "passed" } else { "FAILED" }, Some(time)));
        println!("=== {} took {:.1} s", step.name, time.as_secs_f64());
        failure = result.err();
    }
    if selection == Selection::Quick {
        results.extend(
            STEPS.iter().filter(|step| !step.quick).map(|step| (step.name, "skipped by --quick", None)),
        );
    }
    print!("\n{}", summary(&results, start.elapsed()));
    failure.map_or(Ok(()), Err)
}

fn summary(results: &[(&str, &str, Option<Duration>)], total: Duration) -> String {
    let mut table = String::new();
    for (name, result, time) in results {
        let time = time.map_or_else(String::new, |time| format!("{:8.1} s", time.as_secs_f64()));
        table += format!("{name:<22}{result:<22}{time}").trim_end();
        table.push('\n');
    }
    table + &format!("{:<22}{:<22}{:8.1} s\n", "total", "", total.as_secs_f64())
}

fn format(workspace: &Workspace) -> Result<()> {
    for manifest in workspace.manifests().into_iter().chain([workspace.libfuzzer_manifest()]) {
        execute(workspace.cargo("fmt").arg("--manifest-path").arg(manifest).args(["--all", "--check"]))?;
    }
    Ok(())
}

/// Checks `deny.toml` against the dependencies of every workspace. Advisories need a database from
/// the network and are not part of the tests.
fn licenses(workspace: &Workspace) -> Result<()> {
    tools::require_cargo_deny(workspace)?;
    for manifest in workspace.manifests() {
        let mut command = workspace.cargo("deny");
        command.arg("--manifest-path").arg(manifest).args(["--config", "deny.toml", "check"]);
        execute(command.args(["--hide-inclusion-graph", "bans", "licenses", "sources"]))?;
    }
    Ok(())
}

fn xtask(workspace: &Workspace) -> Result<()> {
    let manifest = workspace.xtask_manifest();
    execute(
        workspace
            .cargo("clippy")
            .arg("--manifest-path")
            .arg(&manifest)
            .args(["--all-targets", "--quiet"])
            .args(DENY),
    )?;
    execute(workspace.cargo("test").arg("--manifest-path").arg(&manifest).arg("--quiet"))
}

const DENY: [&str; 3] = ["--", "-D", "warnings"];

fn clippy(workspace: &Workspace) -> Result<()> {
    execute(workspace.cargo("clippy").args(["--workspace", "--all-targets", "--quiet"]).args(DENY))
}

/// Unit tests, integration tests and doctests.
fn tests(workspace: &Workspace) -> Result<()> {
    execute(vulkan::for_gpu_tests(workspace.cargo("test").args(["--workspace", "--no-fail-fast"])))
}

/// The crate that adds constraints from outside the workspace, like the crate of a user. It shares
/// the build folder of the workspace, so that cargo builds common dependencies only once.
fn third_party(workspace: &Workspace) -> Result<()> {
    let (manifest, target) = (workspace.third_party_manifest(), workspace.target_dir()?);
    let cargo = |subcommand: &str| {
        let mut command = workspace.cargo(subcommand);
        command.arg("--manifest-path").arg(&manifest).env("CARGO_TARGET_DIR", &target);
        command
    };
    execute(cargo("clippy").args(["--all-targets", "--quiet"]).args(DENY))?;
    execute(vulkan::for_gpu_tests(&mut cargo("test")))
}

/// Studies that measure time in their own process and need a release build.
const TIMED_STUDIES: [&str; 5] = ["accuracy", "at-rest", "chainmail", "rest", "speed"];

/// `cargo run` of a study.
pub fn study_command(workspace: &Workspace, name: &str, options: &[&str]) -> Command {
    let mut command = workspace.cargo("run");
    if TIMED_STUDIES.contains(&name) {
        command.arg("--release");
    }
    command.args(["--quiet", "--package", "cutis-studies", "--bin", "study", "--", name]).args(options);
    vulkan::for_gpu_tests(&mut command);
    command
}

/// Compares the backends: once with the limits of the device, and once in small chunks with the
/// limits that every device has. It runs the program that the step `tests` has built. `cargo run`
/// would build the program again, because its dependencies have other features than in the whole
/// workspace.
fn parity(workspace: &Workspace) -> Result<()> {
    for arguments in [&["--quick"][..], &["--quick", "--chunk-cap", "200", "--baseline-limits"]] {
        let mut command = workspace.command(workspace.study("debug")?);
        execute(vulkan::for_gpu_tests(command.arg("parity").args(arguments)))?;
    }
    Ok(())
}

/// Counts the instructions of the inner loops with the program that the step `tests` has built. In
/// CI Valgrind must be there.
fn instructions(workspace: &Workspace) -> Result<()> {
    if !tools::has_valgrind(workspace) {
        if workspace.ci {
            bail!("valgrind is missing; on Debian, `apt-get install -y valgrind`");
        }
        println!("not counted: valgrind is missing (on Debian, `apt-get install -y valgrind`)");
        return Ok(());
    }
    execute(workspace.command(workspace.study("debug")?).arg("instructions"))
}

/// Changed inputs for every reader, for a bounded time, with the program that the step `tests` has
/// built.
fn fuzz_briefly(workspace: &Workspace) -> Result<()> {
    execute(workspace.command(workspace.fuzz()?).args(["--seconds", "20"]))
}

/// The program that tries changed inputs. It is built with checks of integer overflow, and with the
/// features that its dependencies have in the whole workspace.
pub fn fuzz_command(workspace: &Workspace, options: &[&str]) -> Result<Command> {
    execute(workspace.cargo("build").args(["--workspace", "--bins", "--quiet"]))?;
    let mut command = workspace.command(workspace.fuzz()?);
    command.args(options);
    Ok(command)
}

/// Only libraries, because the program `cutis` and the crate `cutis` would write the same page.
fn documentation(workspace: &Workspace) -> Result<()> {
    let mut command = workspace.cargo("doc");
    execute(command.args(["--workspace", "--lib", "--no-deps", "--quiet"]).env("RUSTDOCFLAGS", "-D warnings"))
}

/// Builds the programs of the Python checks, as the step `tests` does.
pub fn build_for_python(workspace: &Workspace) -> Result<()> {
    execute(workspace.cargo("build").args(["--workspace", "--bins"]))
}

fn build_studies(workspace: &Workspace, more: &[&str]) -> Result<()> {
    execute(workspace.cargo("build").args(["--package", "cutis-studies", "--bin", "study"]).args(more))
}

/// The study `cantilever`: bends all beams by the solver and by the FEM of the Python check, and
/// writes the page.
pub fn cantilever(workspace: &Workspace) -> Result<()> {
    build_studies(workspace, &["--release"])?;
    let study = workspace.study("release")?;
    let compared = workspace.target_dir()?.join("cantilever.json");
    let mut command = python::check(workspace, &workspace.root.join("tests/python/cantilever.py"))?;
    command.env("CUTIS_STUDY", &study).arg("--json").arg(&compared);
    execute(vulkan::for_gpu_tests(&mut command))?;
    execute(workspace.command(study).args(["cantilever", "--compared"]).arg(&compared))
}

/// The study `peers`, with the other programs in an environment of their own.
pub fn peers(workspace: &Workspace, options: &[&str]) -> Result<ExitCode> {
    build_studies(workspace, &["--release"])?;
    let mut command = workspace.command(workspace.study("release")?);
    command.arg("peers");
    if !options.contains(&"--help") && !options.contains(&"--python") {
        command.arg("--python").arg(python::peers(workspace)?);
    }
    exit_code(command.args(options))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_summary_names_every_step_with_its_outcome() {
        let second = Some(Duration::from_secs(1));
        let table = summary(
            &[("tidy", "passed", second), ("tests", "FAILED", second), ("python", "not reached", None)],
            Duration::from_secs(2),
        );
        let lines: Vec<&str> = table.lines().collect();
        assert_eq!(lines.len(), 4);
        assert!(lines[1].starts_with("tests") && lines[1].contains("FAILED") && lines[1].ends_with("1.0 s"));
        assert!(lines[2].ends_with("not reached"));
    }

    #[test]
    fn a_study_that_measures_time_is_built_as_a_release() {
        let workspace = Workspace { root: ".".into(), ci: false };
        let is_release =
            |name: &str| study_command(&workspace, name, &[]).get_args().any(|a| a == "--release");
        assert!(is_release("rest") && is_release("speed") && !is_release("parity"));
    }

    #[test]
    fn quick_is_refused_in_ci() {
        let workspace = Workspace { root: ".".into(), ci: true };
        let error = run_all(&workspace, Selection::Quick).unwrap_err().to_string();
        assert!(error.contains("--quick"), "{error}");
    }

    #[test]
    fn an_unknown_step_is_an_error_that_names_the_steps() {
        let workspace = Workspace { root: ".".into(), ci: false };
        let error = run_all(&workspace, Selection::Only("test")).unwrap_err().to_string();
        assert!(names().iter().all(|name| error.contains(name)), "{error}");
    }

    #[test]
    fn a_selection_includes_its_steps() {
        let count = |selection: Selection<'_>| STEPS.iter().filter(|step| selection.includes(step)).count();
        assert_eq!(count(Selection::All), STEPS.len());
        assert_eq!(count(Selection::Only("miri")), 1);
        assert!((2..STEPS.len()).contains(&count(Selection::Quick)));
    }
}
