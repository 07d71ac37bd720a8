//! Rules about manifests: members inherit versions, lints and dependencies from the workspace, and
//! published crates carry their licenses.

use std::path::Path;

use anyhow::{Context, Result};
use serde_json::Value;

use super::Finding;
use super::files::Files;

/// Files that every published crate has, as links to the files of the root.
const LICENSES: [&str; 2] = ["LICENSE-MIT", "LICENSE-APACHE"];

/// Keys of `[package]` that only the workspace manifest sets.
const INHERITED: [&str; 4] = ["version", "edition", "rust-version", "license"];

/// The manifests of the members, as paths from the root.
pub fn members(metadata: &Value, root: &Path) -> Result<Vec<String>> {
    let packages = metadata["packages"].as_array().context("cargo metadata lists no packages")?;
    packages
        .iter()
        .map(|package| {
            let path = Path::new(package["manifest_path"].as_str().context("a package without a manifest")?);
            let path = path
                .strip_prefix(root)
                .with_context(|| format!("{} is outside the checkout", path.display()))?;
            Ok(path.to_string_lossy().replace('\\', "/"))
        })
        .collect()
}

/// Finds values that the manifest of a member should inherit.
pub fn check(path: &str, text: &str) -> Vec<Finding> {
    let table: toml::Table = match text.parse() {
        Ok(table) => table,
        Err(error) => return vec![Finding::failure(path, 0, format!("not TOML: {error}"))],
    };
    let failure = |message: String| Finding::failure(path, 0, message);
    let mut findings = Vec::new();
    for key in INHERITED {
        if !inherits(table.get("package").and_then(|package| package.get(key))) {
            findings.push(failure(format!("write `{key}.workspace = true` in [package]")));
        }
    }
    if !inherits(table.get("lints")) {
        findings.push(failure("write `workspace = true` in [lints]".to_owned()));
    }
    let targets = table.get("target").and_then(toml::Value::as_table);
    let scopes = std::iter::once(&table)
        .chain(targets.into_iter().flat_map(|targets| targets.values().filter_map(toml::Value::as_table)));
    for scope in scopes {
        for section in ["dependencies", "dev-dependencies", "build-dependencies"] {
            let dependencies = scope.get(section).and_then(toml::Value::as_table);
            for (name, value) in dependencies.into_iter().flatten() {
                if !inherits(Some(value)) {
                    findings.push(failure(format!(
                        "`{name}` in [{section}]: its version belongs in the workspace manifest"
                    )));
                }
            }
        }
    }
    findings
}

/// Finds missing license files next to the manifest of a member that is published.
pub fn licenses(path: &str, text: &str, files: &Files) -> Vec<Finding> {
    let table: toml::Table = text.parse().unwrap_or_default();
    let publish =
        table.get("package").and_then(|package| package.get("publish")).and_then(toml::Value::as_bool);
    if publish == Some(false) {
        return Vec::new();
    }
    let folder = path.trim_end_matches("Cargo.toml");
    let missing = LICENSES.iter().filter(|name| !files.exists(&format!("{folder}{name}")));
    missing
        .map(|name| {
            Finding::failure(path, 0, format!("needs `{name}` next to it: ln -s ../../{name} {folder}"))
        })
        .collect()
}

fn inherits(value: Option<&toml::Value>) -> bool {
    value.and_then(|value| value.get("workspace")).and_then(toml::Value::as_bool) == Some(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "
        [package]
        name = \"a\"
        version.workspace = true
        edition.workspace = true
        rust-version.workspace = true
        license.workspace = true
        [lints]
        workspace = true
        [dependencies]
        rayon.workspace = true
        serde = { workspace = true, optional = true }
    ";

    #[test]
    fn a_member_that_inherits_everything_passes() {
        assert_eq!(check("Cargo.toml", GOOD), []);
    }

    #[test]
    fn each_own_value_is_caught() {
        for (from, to) in [
            ("version.workspace = true\n        edition", "version = \"1.0.0\"\n        edition"),
            ("rust-version.workspace = true", "rust-version = \"1.80\""),
            ("license.workspace = true", ""),
            ("[lints]\n        workspace = true", ""),
            ("rayon.workspace = true", "rayon = \"1\""),
            (
                "serde = { workspace = true, optional = true }",
                "[target.'cfg(unix)'.dev-dependencies]\nlibc = \"0.2\"",
            ),
        ] {
            assert!(GOOD.contains(from), "{from}");
            assert_eq!(check("Cargo.toml", &GOOD.replace(from, to)).len(), 1, "{from} -> {to}");
        }
        assert_eq!(check("Cargo.toml", "not toml").len(), 1);
    }

    #[test]
    fn a_published_crate_without_its_licenses_is_caught() {
        let files = Files::of(&["crates/a/LICENSE-MIT", "crates/a/LICENSE-APACHE", "crates/b/LICENSE-MIT"]);
        assert_eq!(licenses("crates/a/Cargo.toml", GOOD, &files), []);
        assert_eq!(licenses("crates/b/Cargo.toml", GOOD, &files).len(), 1);
        let unpublished = GOOD.replace("[package]", "[package]\npublish = false");
        assert_eq!(licenses("crates/b/Cargo.toml", &unpublished, &files), []);
    }
}
