//! The released `cutis` program and the reports of its runs.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, bail, ensure};
use serde_json::Value;

use super::{Failure, cargo, command, execute, target_dir};

/// The released program.
#[derive(Clone, Debug)]
pub struct Program {
    path: PathBuf,
}

impl Program {
    /// Builds the program.
    ///
    /// # Errors
    /// The build fails.
    pub fn build() -> Result<Self, Failure> {
        execute(cargo("build").args(["--release", "--package", "cutis-cli"]))?;
        let path = target_dir()?.join(format!("release/cutis{}", std::env::consts::EXE_SUFFIX));
        ensure!(path.is_file(), "{} is missing", path.display());
        Ok(Self { path })
    }

    /// Runs the program in the root of the checkout and returns its standard output.
    ///
    /// # Errors
    /// The exit code is not 0; the error holds what the program printed.
    pub fn run(&self, arguments: impl FnOnce(&mut Command)) -> Result<Vec<u8>, Failure> {
        let mut command = command(&self.path);
        arguments(&mut command);
        let output = command.output().context("cannot start the program")?;
        if !output.status.success() {
            bail!("{command:?} failed: {}", String::from_utf8_lossy(&output.stderr).trim());
        }
        Ok(output.stdout)
    }

    /// Runs a scene file with `--set KEY=VALUE` for each of `set` and with `options`. Returns the
    /// report of the run.
    ///
    /// # Errors
    /// The errors of [`run`](Self::run), or the run wrote no report.
    pub fn scene(
        &self,
        scene: &Path,
        set: &[String],
        options: &[&str],
        out: &Path,
    ) -> Result<Value, Failure> {
        let name = scene.file_stem().unwrap_or_default().to_string_lossy();
        eprintln!("{name} {} {}", set.join(" "), options.join(" "));
        self.run(|command| {
            command.arg("run").arg(scene).args(options).arg("--out").arg(out);
            command.args(set.iter().flat_map(|change| ["--set", change]));
        })?;
        Ok(serde_json::from_slice(&std::fs::read(out.join("report.json"))?)?)
    }
}

/// The number at a JSON pointer.
///
/// # Errors
/// There is no number.
pub fn number_at(value: &Value, pointer: &str) -> Result<f64, Failure> {
    value.pointer(pointer).and_then(Value::as_f64).with_context(|| format!("no number at {pointer}"))
}
