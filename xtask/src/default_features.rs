//! Tests without default features: code behind `not(feature = ...)` runs only there.

use anyhow::Result;

use crate::workspace::{Workspace, execute};

/// A package that the step builds without default features.
struct Package {
    name: &'static str,
    subcommand: &'static str,
}

/// Every package with `not(feature = ...)` in its sources or tests needs a row with `test`; `tidy`
/// checks that.
const PACKAGES: &[Package] =
    &[Package { name: "cutis", subcommand: "test" }, Package { name: "cutis-cli", subcommand: "build" }];

/// Lints and then tests or builds each package of the table.
pub fn run(workspace: &Workspace) -> Result<()> {
    for package in PACKAGES {
        let mut command = workspace.cargo("clippy");
        command.args(["--package", package.name, "--no-default-features", "--all-targets", "--quiet"]);
        execute(command.args(["--", "-D", "warnings"]))?;
        let mut command = workspace.cargo(package.subcommand);
        execute(command.args(["--package", package.name, "--no-default-features"]))?;
    }
    Ok(())
}

/// Whether the tests of the package run without default features.
pub fn is_tested(package: &str) -> bool {
    PACKAGES.iter().any(|row| row.name == package && row.subcommand == "test")
}

#[cfg(test)]
mod tests {
    use super::is_tested;

    #[test]
    fn a_package_counts_only_if_its_tests_run() {
        assert!(is_tested("cutis"));
        assert!(!is_tested("cutis-cli"));
        assert!(!is_tested("cutis-render"));
    }
}
