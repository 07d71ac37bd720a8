//! Folders of the checkout, and child processes that run in its root.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, bail};

use super::Failure;

/// The folder of the root `Cargo.toml`.
pub fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// The folder of the result pages.
pub fn results() -> PathBuf {
    root().join("docs/results")
}

/// A scene file of `fixtures/scenes`, by its name without ending.
pub fn scene(name: &str) -> PathBuf {
    root().join("fixtures/scenes").join(name).with_extension("toml")
}

/// The folder of build outputs. Follows `CARGO_TARGET_DIR`.
///
/// # Errors
/// `cargo metadata` fails.
pub fn target_dir() -> Result<PathBuf, Failure> {
    let output = cargo("metadata").args(["--format-version", "1", "--no-deps"]).output()?;
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout)?;
    let folder = metadata["target_directory"].as_str();
    folder.map(PathBuf::from).context("cargo metadata names no target_directory")
}

/// A program that runs in the root of the checkout.
pub fn command(program: impl AsRef<OsStr>) -> Command {
    let mut command = Command::new(program);
    command.current_dir(root());
    command
}

/// `cargo SUBCOMMAND` in the root of the checkout.
pub fn cargo(subcommand: &str) -> Command {
    let mut command = command(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.arg(subcommand);
    command
}

/// Runs a program and shows its output.
///
/// # Errors
/// The program cannot be started, or its exit code is not 0.
pub fn execute(command: &mut Command) -> Result<(), Failure> {
    let status = command.status().with_context(|| format!("cannot start {command:?}"))?;
    if !status.success() {
        bail!("{command:?} ended with {status}");
    }
    Ok(())
}
