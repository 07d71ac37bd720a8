//! Tests without default features: code behind `not(feature = ...)` runs only there.

use anyhow::Result;

use crate::workspace::{Workspace, execute};

/// A package that the step builds without default features.
struct Package {
    name: &'static str,
    /// Run its tests too. Otherwise it is only linted, which compiles it.
    test: bool,
}

/// Every package with `not(feature = ...)` in its sources or tests needs `test: true`; `tidy`
/// checks that.
const PACKAGES: &[Package] =
    &[Package { name: "cutis", test: true }, Package { name: "cutis-cli", test: false }];

/// Lints each package of the table, and tests those that say so.
pub fn run(workspace: &Workspace) -> Result<()> {
    for package in PACKAGES {
        let mut command = workspace.cargo("clippy");
        command.args(["--package", package.name, "--no-default-features", "--all-targets", "--quiet"]);
        execute(command.args(["--", "-D", "warnings"]))?;
        if package.test {
            // Other features of the dependencies need another build. These short tests gain less
            // from optimized code than its build costs.
            let mut command = workspace.cargo("test");
            command.env("CARGO_PROFILE_DEV_OPT_LEVEL", "0");
            execute(command.args(["--package", package.name, "--no-default-features"]))?;
        }
    }
    Ok(())
}

/// Whether the tests of the package run without default features.
pub fn is_tested(package: &str) -> bool {
    PACKAGES.iter().any(|row| row.name == package && row.test)
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
