//! The steps of `cargo xtask test`, in order, each timed; the first failure ends the run.

use std::process::Command;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};

use crate::workspace::{Workspace, execute};
use crate::{deny, publish, python, tidy, vulkan};

struct Step {
    name: &'static str,
    /// Also part of `--quick`.
    quick: bool,
    run: fn(&Workspace) -> Result<()>,
}

const STEPS: &[Step] = &[
    Step { name: "tools", quick: true, run: tools },
    Step { name: "format", quick: true, run: format },
    Step { name: "tidy", quick: true, run: tidy::run },
    Step { name: "licenses", quick: true, run: deny::run },
    Step { name: "xtask", quick: true, run: xtask },
    Step { name: "clippy", quick: true, run: clippy },
    Step { name: "tests", quick: true, run: tests },
    Step { name: "third-party", quick: false, run: third_party },
    Step { name: "parity", quick: false, run: parity },
    Step { name: "documentation", quick: false, run: documentation },
    Step { name: "program", quick: false, run: build_program },
    Step { name: "python", quick: false, run: python::run },
    Step { name: "publish --dry-run", quick: false, run: publish::dry_run },
];

/// Runs every step, or with `quick` the quick ones; prints what was run, how long it took and what was left out.
pub fn run_all(workspace: &Workspace, quick: bool) -> Result<()> {
    if quick && workspace.ci {
        bail!("`--quick` leaves steps out, and CI is set: run `cargo xtask test`");
    }
    let start = Instant::now();
    let mut outcomes = Vec::new();
    let mut failure = None;
    for (number, step) in STEPS.iter().enumerate() {
        if failure.is_some() {
            outcomes.push((step.name, "not reached", None));
        } else if quick && !step.quick {
            outcomes.push((step.name, "left out by --quick", None));
        } else {
            println!("\n=== {}/{} {}", number + 1, STEPS.len(), step.name);
            let step_start = Instant::now();
            let result = (step.run)(workspace).with_context(|| format!("step `{}` failed", step.name));
            outcomes.push((
                step.name,
                if result.is_ok() { "passed" } else { "FAILED" },
                Some(step_start.elapsed()),
            ));
            println!("=== {} took {:.1} s", step.name, step_start.elapsed().as_secs_f64());
            failure = result.err();
        }
    }
    print!("\n{}", summary(&outcomes, start.elapsed()));
    failure.map_or(Ok(()), Err)
}

fn summary(outcomes: &[(&str, &str, Option<Duration>)], total: Duration) -> String {
    let mut table = String::new();
    for (name, outcome, time) in outcomes {
        let time = time.map_or_else(String::new, |time| format!("{:8.1} s", time.as_secs_f64()));
        table += format!("{name:<20}{outcome:<22}{time}").trim_end();
        table.push('\n');
    }
    table + &format!("{:<20}{:<22}{:8.1} s\n", "total", "", total.as_secs_f64())
}

/// Everything that later steps need, asked for before the long ones begin.
fn tools(workspace: &Workspace) -> Result<()> {
    for (subcommand, component) in [("fmt", "rustfmt"), ("clippy", "clippy")] {
        let found = workspace
            .command(workspace.cargo(subcommand).get_program())
            .args([subcommand, "--version"])
            .output();
        if !found.is_ok_and(|output| output.status.success()) {
            bail!("`cargo {subcommand}` is missing; install it with `rustup component add {component}`");
        }
    }
    let python = python::require(workspace)?;
    let adapters = vulkan::require(workspace)?;
    println!("rustfmt, clippy and {python} are there; adapters for GPU tests: {adapters}");
    Ok(())
}

fn format(workspace: &Workspace) -> Result<()> {
    for manifest in workspace.manifests() {
        execute(workspace.cargo("fmt").arg("--manifest-path").arg(manifest).args(["--all", "--check"]))?;
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

/// The crate that adds constraints from outside, as a user's would. It shares the folder of builds: what does not differ
/// is not built again.
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

/// The comparison of the backends that `cargo xtask parity` runs.
pub fn parity_command(workspace: &Workspace, arguments: &[&str]) -> Command {
    let mut command = workspace.cargo("run");
    command.args(["--quiet", "--package", "cutis-tests", "--bin", "parity", "--"]).args(arguments);
    vulkan::for_gpu_tests(&mut command);
    command
}

/// `cargo run` of the stability suite; its last words are `arguments`.
pub fn stability_command(workspace: &Workspace, arguments: &[&str]) -> Command {
    let mut command = workspace.cargo("run");
    command.args(["--quiet", "--package", "cutis-tests", "--bin", "stability", "--"]).args(arguments);
    vulkan::for_gpu_tests(&mut command);
    command
}

/// The measurement of error against run time that `cargo xtask accuracy` runs: released, since it takes times.
pub fn accuracy_command(workspace: &Workspace, arguments: &[&str]) -> Command {
    released(workspace, "accuracy", arguments)
}

/// ChainMail on scans that `cargo xtask chainmail` runs: released, since it takes times.
pub fn chainmail_command(workspace: &Workspace, arguments: &[&str]) -> Command {
    released(workspace, "chainmail", arguments)
}

/// A program of `cutis-tests` that takes times.
fn released(workspace: &Workspace, program: &str, arguments: &[&str]) -> Command {
    let mut command = workspace.cargo("run");
    let build = ["--quiet", "--release", "--package", "cutis-tests", "--bin", program, "--"];
    command.args(build).args(arguments);
    vulkan::for_gpu_tests(&mut command);
    command
}

/// Runs the program that the step `tests` has built. `cargo run` would build it once more, since the features of shared
/// dependencies differ from those of the whole workspace. Once as the device is, and once in small chunks within the limits
/// that any device has.
fn parity(workspace: &Workspace) -> Result<()> {
    for arguments in [&["--quick"][..], &["--quick", "--chunk-cap", "200", "--baseline-limits"]] {
        execute(vulkan::for_gpu_tests(workspace.command(workspace.parity()?).args(arguments)))?;
    }
    Ok(())
}

/// Libraries only: the program `cutis` and the crate `cutis` would write the same page.
fn documentation(workspace: &Workspace) -> Result<()> {
    let mut command = workspace.cargo("doc");
    execute(command.args(["--workspace", "--lib", "--no-deps", "--quiet"]).env("RUSTDOCFLAGS", "-D warnings"))
}

/// Builds what the Python checks run: the release program, and the one that bends beams.
pub fn build_for_python(workspace: &Workspace) -> Result<()> {
    build_program(workspace)?;
    build_cantilever(workspace, &[])
}

fn build_cantilever(workspace: &Workspace, more: &[&str]) -> Result<()> {
    execute(workspace.cargo("build").args(["--package", "cutis-tests", "--bin", "cantilever"]).args(more))
}

/// Beams bent by the solver and by an independent FEM, all of them: writes `docs/results/cantilever.md` and its table.
pub fn cantilever(workspace: &Workspace) -> Result<()> {
    build_cantilever(workspace, &["--release"])?;
    let mut command = python::check(workspace, &workspace.root.join("tests/python/cantilever.py"))?;
    command.env("CUTIS_CANTILEVER", workspace.cantilever("release")?).args(["--page", "docs/results"]);
    execute(vulkan::for_gpu_tests(&mut command))
}

/// Builds the release program.
pub fn build_program(workspace: &Workspace) -> Result<()> {
    execute(workspace.cargo("build").args(["--release", "--package", "cutis-cli"]))
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
    fn quick_is_refused_in_ci() {
        let workspace = Workspace { root: ".".into(), ci: true };
        assert!(run_all(&workspace, true).unwrap_err().to_string().contains("--quick"));
    }
}
