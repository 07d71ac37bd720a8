//! The checkout: its root, its cargo and its metadata, and how to run other programs in it.

use std::ffi::OsString;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

use anyhow::{Context, Result, bail};
use serde_json::Value;

/// The checkout, and whether the stricter rules of CI hold.
pub struct Workspace {
    /// The folder that holds the root `Cargo.toml`.
    pub root: PathBuf,
    /// True when `CI` is set: no test may be skipped, and lock files must be up to date.
    pub ci: bool,
}

/// The packages that `cargo metadata` lists.
pub enum Scope {
    /// The packages of a workspace.
    Members,
    /// The packages of a workspace, and all dependencies with default features.
    Dependencies,
}

impl Workspace {
    /// The checkout that holds this program.
    pub fn find() -> Result<Self> {
        let manifest_dir = std::env::var_os("CARGO_MANIFEST_DIR")
            .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")), PathBuf::from);
        let root = manifest_dir.parent().context("xtask has no parent folder")?.to_path_buf();
        let ci = std::env::var_os("CI").is_some_and(|value| !value.is_empty() && value != "false");
        Ok(Self { root, ci })
    }

    /// The same checkout with the rules of CI.
    pub fn in_ci(self) -> Self {
        Self { ci: true, ..self }
    }

    /// The manifest of this program, which has its own workspace.
    pub fn xtask_manifest(&self) -> PathBuf {
        self.root.join("xtask/Cargo.toml")
    }

    /// The manifest of the crate that uses the project from outside. It has its own workspace, too.
    pub fn third_party_manifest(&self) -> PathBuf {
        self.root.join("tests/third-party/Cargo.toml")
    }

    /// The manifest of the targets of cargo-fuzz. They have their own workspace, which the tests
    /// only format, because libFuzzer is C++ and needs a nightly compiler.
    pub fn libfuzzer_manifest(&self) -> PathBuf {
        self.root.join("tests/fuzz/libfuzzer/Cargo.toml")
    }

    /// The manifests of the workspaces of the checkout that the tests build.
    pub fn manifests(&self) -> [PathBuf; 3] {
        [self.root.join("Cargo.toml"), self.xtask_manifest(), self.third_party_manifest()]
    }

    /// A command that runs in the root, with `CI` set if the rules of CI hold.
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

    /// The program `cutis` that `cargo test --workspace` builds: optimized, with checks of integer
    /// overflow and debug assertions.
    pub fn program(&self) -> Result<PathBuf> {
        self.built("debug/cutis", "cargo build --workspace --bins")
    }

    /// The program of the studies. `cargo test --workspace` builds it with the profile `debug`.
    pub fn study(&self, profile: &str) -> Result<PathBuf> {
        self.built(&format!("{profile}/study"), "cargo build -p cutis-studies --bin study")
    }

    /// The program that tries changed inputs with every reader.
    pub fn fuzz(&self) -> Result<PathBuf> {
        self.built("debug/fuzz", "cargo build --workspace --bins")
    }

    /// A program in the build folder. If it is missing, the error names the command that builds it.
    fn built(&self, path: &str, build: &str) -> Result<PathBuf> {
        let program = self.target_dir()?.join(format!("{path}{}", std::env::consts::EXE_SUFFIX));
        if !program.is_file() {
            bail!("{} is missing; build it with `{build}`", program.display());
        }
        Ok(program)
    }

    /// The build folder. `CARGO_TARGET_DIR` can change it.
    pub fn target_dir(&self) -> Result<PathBuf> {
        let metadata = self.metadata(&self.root.join("Cargo.toml"), Scope::Members)?;
        let folder =
            metadata["target_directory"].as_str().context("cargo metadata names no target_directory")?;
        Ok(PathBuf::from(folder))
    }
}

/// Prints the command line and runs the program, which prints its own output.
///
/// # Errors
/// The program does not start or does not end with 0.
pub fn execute(command: &mut Command) -> Result<()> {
    let line = command_line(command);
    println!("$ {line}");
    let status = command.status().with_context(|| format!("cannot start `{line}`"))?;
    if !status.success() {
        bail!("`{line}` ended with {status}");
    }
    Ok(())
}

/// Runs a program as [`execute`] does and returns a copy of its standard output.
pub fn execute_and_read(command: &mut Command) -> Result<String> {
    let line = command_line(command);
    println!("$ {line}");
    let mut child =
        command.stdout(Stdio::piped()).spawn().with_context(|| format!("cannot start `{line}`"))?;
    let mut output = String::new();
    for text in BufReader::new(child.stdout.take().context("no output")?).lines() {
        let text = text.with_context(|| format!("cannot read the output of `{line}`"))?;
        println!("{text}");
        output += &text;
        output.push('\n');
    }
    let status = child.wait()?;
    if !status.success() {
        bail!("`{line}` ended with {status}");
    }
    Ok(output)
}

/// Runs a program as [`execute`] does and returns its exit code.
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
