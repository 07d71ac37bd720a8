//! The checkout that is worked on: its root, its cargo, its metadata, and how child programs are run.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use anyhow::{Context, Result, bail};
use serde_json::Value;

/// The checkout, and whether it is tested under CI's stricter rules.
pub struct Workspace {
    /// The folder that holds the root `Cargo.toml`.
    pub root: PathBuf,
    /// True when `CI` is set: nothing is skipped and lock files must be up to date.
    pub ci: bool,
}

/// What `cargo metadata` is asked for.
pub enum Scope {
    /// The packages of a workspace.
    Members,
    /// Those and all that they resolve to with their default features.
    Dependencies,
}

impl Workspace {
    /// The checkout this program was started from.
    pub fn find() -> Result<Self> {
        let manifest_dir = std::env::var_os("CARGO_MANIFEST_DIR")
            .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")), PathBuf::from);
        let root = manifest_dir.parent().context("xtask has no parent folder")?.to_path_buf();
        let ci = std::env::var_os("CI").is_some_and(|value| !value.is_empty() && value != "false");
        Ok(Self { root, ci })
    }

    /// The same checkout under CI's rules.
    pub fn in_ci(self) -> Self {
        Self { ci: true, ..self }
    }

    /// The manifest of this program, which is a workspace of its own.
    pub fn xtask_manifest(&self) -> PathBuf {
        self.root.join("xtask/Cargo.toml")
    }

    /// The manifest of the crate that uses the project from outside, in a workspace of its own too.
    pub fn third_party_manifest(&self) -> PathBuf {
        self.root.join("tests/third-party/Cargo.toml")
    }

    /// The manifests of all workspaces of the checkout.
    pub fn manifests(&self) -> [PathBuf; 3] {
        [self.root.join("Cargo.toml"), self.xtask_manifest(), self.third_party_manifest()]
    }

    /// A program to be run from the root, told whether this is CI.
    pub fn command(&self, program: impl Into<OsString>) -> Command {
        let mut command = Command::new(program.into());
        command.current_dir(&self.root);
        if self.ci {
            command.env("CI", "true");
        }
        command
    }

    /// The cargo that started this program.
    pub fn cargo_program() -> OsString {
        std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into())
    }

    /// `cargo SUBCOMMAND`, with `--locked` in CI where the subcommand resolves dependencies.
    pub fn cargo(&self, subcommand: &str) -> Command {
        let mut command = self.command(Self::cargo_program());
        command.arg(subcommand);
        if self.ci && subcommand != "fmt" {
            command.arg("--locked");
        }
        if self.ci {
            // CI builds everything once, so that the files of incremental builds only cost time.
            command.env("CARGO_INCREMENTAL", "0");
        }
        command
    }

    /// `cargo metadata` of one of the workspaces.
    pub fn metadata(&self, manifest: &Path, scope: Scope) -> Result<Value> {
        let mut command = self.cargo("metadata");
        command.args(["--format-version", "1", "--manifest-path"]).arg(manifest);
        command.args(match scope {
            Scope::Members => Some("--no-deps"),
            Scope::Dependencies => None,
        });
        let output = command.output().context("cannot start cargo")?;
        if !output.status.success() {
            bail!("cargo metadata failed: {}", String::from_utf8_lossy(&output.stderr).trim());
        }
        serde_json::from_slice(&output.stdout).context("cargo metadata did not print JSON")
    }

    /// The commit of the checkout, marked if there are changes since.
    pub fn commit(&self) -> Result<String> {
        let words = ["describe", "--always", "--dirty", "--abbrev=12", "--exclude=*"];
        let output = self.command("git").args(words).output().context("cannot start git")?;
        Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
    }

    /// The released `cutis` program.
    pub fn program(&self) -> Result<PathBuf> {
        self.built("release/cutis", "cargo build --release -p cutis-cli")
    }

    /// Runs the released `cutis` program; what it prints, or an error with what it complains of.
    pub fn run_program(&self, arguments: impl FnOnce(&mut Command)) -> Result<Vec<u8>> {
        let mut command = self.command(self.program()?);
        arguments(&mut command);
        let output = command.output().context("cannot start the program")?;
        if !output.status.success() {
            bail!("{command:?} failed: {}", String::from_utf8_lossy(&output.stderr).trim());
        }
        Ok(output.stdout)
    }

    /// The program that compares the backends, as the tests of the workspace leave it behind.
    pub fn parity(&self) -> Result<PathBuf> {
        self.built("debug/parity", "cargo test --workspace --no-run")
    }

    /// The program that bends beams for the independent FEM, as the tests of the workspace leave it behind, or released.
    pub fn cantilever(&self, profile: &str) -> Result<PathBuf> {
        self.built(&format!("{profile}/cantilever"), "cargo build -p cutis-tests --bin cantilever")
    }

    /// A program in the folder of builds; if it is missing, the error names the command that builds it.
    fn built(&self, path: &str, build: &str) -> Result<PathBuf> {
        let program = self.target_dir()?.join(format!("{path}{}", std::env::consts::EXE_SUFFIX));
        if !program.is_file() {
            bail!("{} is missing; build it with `{build}`", program.display());
        }
        Ok(program)
    }

    /// The folder of real volumes: `CUTIS_TEST_DATA`, else `shared/data` beside the checkout. None if there is none, an
    /// error in CI.
    pub fn test_data(&self) -> Result<Option<PathBuf>> {
        let folder = std::env::var_os("CUTIS_TEST_DATA")
            .map_or_else(|| self.root.join("../shared/data"), PathBuf::from);
        match folder.is_dir() {
            true => Ok(Some(folder)),
            false if self.ci => {
                bail!("{} is missing; in CI the real volumes must be there", folder.display())
            }
            false => Ok(None),
        }
    }

    /// Where builds go; follows `CARGO_TARGET_DIR`.
    pub fn target_dir(&self) -> Result<PathBuf> {
        let metadata = self.metadata(&self.root.join("Cargo.toml"), Scope::Members)?;
        let folder =
            metadata["target_directory"].as_str().context("cargo metadata names no target_directory")?;
        Ok(PathBuf::from(folder))
    }
}

/// Runs a program with its output shown, after printing its command line; an error if it does not end with 0.
pub fn execute(command: &mut Command) -> Result<()> {
    let line = command_line(command);
    println!("$ {line}");
    let status = command.status().with_context(|| format!("cannot start `{line}`"))?;
    if !status.success() {
        bail!("`{line}` ended with {status}");
    }
    Ok(())
}

/// Runs a program as [`execute`] does, and gives what it ended with.
pub fn exit_code(command: &mut Command) -> Result<ExitCode> {
    let line = command_line(command);
    println!("$ {line}");
    let status = command.status().with_context(|| format!("cannot start `{line}`"))?;
    let code = status.code().with_context(|| format!("`{line}` ended with {status}"))?;
    Ok(u8::try_from(code).map_or(ExitCode::FAILURE, ExitCode::from))
}

fn command_line(command: &Command) -> String {
    let program = Path::new(command.get_program()).file_name().unwrap_or(command.get_program());
    std::iter::once(program)
        .chain(command.get_args())
        .map(|word| word.to_string_lossy().into_owned())
        .collect::<Vec<_>>()
        .join(" ")
}
