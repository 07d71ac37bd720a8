//! The programs that the tests need. A missing one is an error that says how to install it.

use anyhow::{Result, bail};

use crate::workspace::Workspace;
use crate::{book, miri, python, vulkan};

/// Checks for every tool before the long steps begin. The slow steps need some that the quick ones
/// do not.
pub fn require(workspace: &Workspace, slow_steps: bool) -> Result<()> {
    require_subcommand(workspace, "fmt", "rustup component add rustfmt")?;
    require_subcommand(workspace, "clippy", "rustup component add clippy")?;
    require_cargo_deny(workspace)?;
    let adapters = vulkan::require(workspace)?;
    println!("rustfmt, clippy and cargo-deny are installed; adapters for GPU tests: {adapters}");
    if slow_steps {
        let python = python::require(workspace)?;
        println!("the report is checked in {}", python::require_browser(workspace)?);
        println!("the book is built by {}", book::require(workspace)?.display());
        println!("{python} with venv is installed; unsafe code is checked by {}", miri::require(workspace)?);
    }
    Ok(())
}

/// Checks for `cargo deny`.
pub fn require_cargo_deny(workspace: &Workspace) -> Result<()> {
    require_subcommand(workspace, "deny", "cargo install --locked cargo-deny")
}

/// Whether Valgrind is installed.
pub fn has_valgrind(workspace: &Workspace) -> bool {
    let found = workspace.command("valgrind").arg("--version").output();
    found.is_ok_and(|output| output.status.success())
}

fn require_subcommand(workspace: &Workspace, name: &str, install: &str) -> Result<()> {
    // Not `Workspace::cargo`, whose `--locked` an external subcommand may not accept here.
    let found = workspace.command(Workspace::cargo_program()).args([name, "--version"]).output();
    if found.is_ok_and(|output| output.status.success()) {
        return Ok(());
    }
    bail!("`cargo {name}` is missing; install it with `{install}`")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_subcommand_is_an_error_with_the_command_that_installs_it() {
        let workspace = Workspace { root: ".".into(), ci: false };
        let error = require_subcommand(&workspace, "no-such-subcommand", "cargo install x").unwrap_err();
        let text = error.to_string();
        assert!(text.contains("`cargo no-such-subcommand` is missing") && text.contains("cargo install x"));
        require_subcommand(&workspace, "fmt", "").unwrap();
    }
}
