//! Runs the tests of the `unsafe` files under Miri or, where no toolchain has it, under Valgrind.
//!
//! Miri finds data races and every use of memory that Rust forbids. Valgrind only finds accesses
//! outside allocated memory and uses of uninitialized values.

use std::fmt;
use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use serde_json::Value;

use crate::unsafe_files::{Tests, UNSAFE_FILES};
use crate::workspace::{Workspace, execute_and_read};

/// How to install the checkers, the better one first.
const INSTALL: &str = "`rustup toolchain install nightly --profile minimal --component miri,rust-src`, \
                       or Valgrind: on Debian, `apt-get install -y valgrind`";

/// The program that checks the tests.
#[derive(Debug, PartialEq)]
pub enum Checker {
    Miri { toolchain: String },
    Valgrind,
}

impl fmt::Display for Checker {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Miri { toolchain } => write!(f, "Miri of the toolchain {toolchain}"),
            Self::Valgrind => write!(f, "Valgrind, because no nightly toolchain has Miri"),
        }
    }
}

/// The best checker of this machine.
///
/// # Errors
/// There is neither Miri nor Valgrind.
pub fn require(workspace: &Workspace) -> Result<Checker> {
    let output = |program: &str, arguments: &[&str]| {
        let output = workspace.command(program).args(arguments).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).into_owned())
    };
    let components = |toolchain: &str| {
        output("rustup", &["component", "list", "--installed", "--toolchain", toolchain]).unwrap_or_default()
    };
    choose(
        &output("rustup", &["toolchain", "list"]).unwrap_or_default(),
        |toolchain| has_miri(&components(toolchain)),
        || output("valgrind", &["--version"]).is_some(),
    )
}

/// Whether the components of a toolchain include Miri and the sources that it compiles first.
fn has_miri(components: &str) -> bool {
    ["miri-", "rust-src"].iter().all(|name| components.lines().any(|line| line.starts_with(name)))
}

/// `toolchains` is the output of `rustup toolchain list`.
fn choose(
    toolchains: &str,
    has_miri: impl Fn(&str) -> bool,
    has_valgrind: impl Fn() -> bool,
) -> Result<Checker> {
    let names = toolchains.lines().filter_map(|line| line.split_whitespace().next());
    if let Some(toolchain) = names.filter(|name| name.starts_with("nightly")).find(|name| has_miri(name)) {
        return Ok(Checker::Miri { toolchain: toolchain.to_owned() });
    }
    if has_valgrind() {
        return Ok(Checker::Valgrind);
    }
    bail!("the tests of unsafe code need Miri: {INSTALL}")
}

/// Runs the tests of every file.
pub fn run(workspace: &Workspace) -> Result<()> {
    let checker = require(workspace)?;
    println!("unsafe code is checked by {checker}");
    let mut passed_before: Vec<&Tests> = Vec::new();
    for file in UNSAFE_FILES {
        let Some(tests) = &file.tests else {
            println!("no check of {}: {}", file.path, file.reason);
            continue;
        };
        if passed_before.contains(&tests) {
            println!("{}: the same tests", file.path);
            continue;
        }
        passed_before.push(tests);
        let output = match &checker {
            Checker::Miri { toolchain } => under_miri(workspace, toolchain, tests)?,
            Checker::Valgrind => under_valgrind(workspace, tests)?,
        };
        match passed(&output) {
            0 => bail!("no test of {} has `{}` in its name", tests.package, tests.filter),
            count => println!("{}: {count} tests pass under {checker}", file.path),
        }
    }
    Ok(())
}

fn under_miri(workspace: &Workspace, toolchain: &str, tests: &Tests) -> Result<String> {
    let mut command = workspace.command("rustup");
    command.args([
        "run",
        toolchain,
        "cargo",
        "miri",
        "test",
        "--package",
        tests.package,
        "--lib",
        tests.filter,
    ]);
    // The cargo that started this program belongs to another toolchain.
    command.env_remove("CARGO").env_remove("RUSTUP_TOOLCHAIN");
    if !tests.target_features.is_empty() && cfg!(target_arch = "x86_64") {
        command.env("RUSTFLAGS", format!("-C target-feature={}", tests.target_features));
    }
    execute_and_read(&mut command)
}

fn under_valgrind(workspace: &Workspace, tests: &Tests) -> Result<String> {
    let mut build = workspace.cargo("test");
    build.args([
        "--package",
        tests.package,
        "--lib",
        "--no-run",
        "--message-format",
        "json-render-diagnostics",
    ]);
    let output = build.stderr(std::process::Stdio::inherit()).output().context("cannot start cargo")?;
    let program = test_program(&String::from_utf8_lossy(&output.stdout))
        .with_context(|| format!("the tests of {} do not compile", tests.package))?;
    let mut command = workspace.command("valgrind");
    execute_and_read(command.args(["--quiet", "--error-exitcode=1"]).arg(program).arg(tests.filter))
}

/// The number of tests that passed, from the output of a test program.
fn passed(output: &str) -> usize {
    let counts = output.lines().filter_map(|line| line.strip_prefix("test result: ok. ")?.split(' ').next());
    counts.filter_map(|count| count.parse::<usize>().ok()).sum()
}

/// The test program among the messages of `cargo test --no-run`.
fn test_program(messages: &str) -> Option<PathBuf> {
    messages.lines().find_map(|line| {
        let message: Value = serde_json::from_str(line).ok()?;
        message["executable"].as_str().map(PathBuf::from)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOOLCHAINS: &str = "stable-x (active, default)\nnightly-2026-01-01-x\nnightly-x\n1.95.0-x\n";

    #[test]
    fn a_nightly_toolchain_with_miri_is_preferred() {
        let found = choose(TOOLCHAINS, |name| name == "nightly-x", || true).unwrap();
        assert_eq!(found, Checker::Miri { toolchain: "nightly-x".to_owned() });
        assert!(found.to_string().contains("Miri"));
    }

    #[test]
    fn valgrind_is_the_second_choice_and_is_named() {
        for toolchains in [TOOLCHAINS, "stable-x\n", ""] {
            let found = choose(toolchains, |_| false, || true).unwrap();
            assert!(found == Checker::Valgrind && found.to_string().contains("Valgrind"));
        }
    }

    #[test]
    fn without_a_checker_the_error_says_what_to_install() {
        let error = choose(TOOLCHAINS, |_| false, || false).unwrap_err().to_string();
        assert!(error.contains("--component miri") && error.contains("valgrind"), "{error}");
    }

    #[test]
    fn miri_needs_the_sources_of_the_standard_library() {
        assert!(has_miri("cargo-x\nmiri-x\nrust-src\n"));
        assert!(!has_miri("miri-x\n") && !has_miri("rust-src\n") && !has_miri(""));
    }

    #[test]
    fn a_filter_without_tests_is_seen() {
        assert_eq!(passed("running 0 tests\n\ntest result: ok. 0 passed; 0 failed; 4 filtered out\n"), 0);
        assert_eq!(passed("running 3 tests\n\ntest result: ok. 3 passed; 0 failed\n"), 3);
        assert_eq!(passed(""), 0);
    }

    #[test]
    fn the_test_program_is_found_among_the_messages() {
        let messages = "{\"executable\":null}\n{\"executable\":\"/t/tests-1\"}\n{\"success\":true}\n";
        assert_eq!(test_program(messages), Some(PathBuf::from("/t/tests-1")));
        assert_eq!(test_program("{\"success\":false}\n"), None);
    }
}
