//! Rules about the crates of the workspace and their files: one integration-test binary each, no
//! files of other crates, and tests of code that is compiled only without a feature.

use anyhow::{Context, Result};
use serde_json::Value;

use super::Finding;
use super::source::{Line, Source};
use crate::default_features;

/// Integration-test binaries beyond the first of a crate, with the reason for each.
const MORE_TEST_BINARIES: [(&str, &str, &str); 1] = [(
    "cutis-solver-cpu",
    "allocations",
    "its global allocator counts, so that no other test may run with it",
)];

/// A crate of the workspace.
pub struct Crate {
    name: String,
    /// Folder from the root, with a `/` at its end.
    folder: String,
    /// Names of the integration-test binaries.
    test_binaries: Vec<String>,
}

/// The members of the workspace, from `cargo metadata`, and the paths of their manifests from the
/// root.
pub fn members(metadata: &Value, manifests: &[String]) -> Result<Vec<Crate>> {
    let packages = metadata["packages"].as_array().context("cargo metadata lists no packages")?;
    let member = |(package, manifest): (&Value, &String)| {
        let targets = package["targets"].as_array().context("a package without targets")?;
        let is_test =
            |target: &&Value| target["kind"].as_array().is_some_and(|kinds| kinds.contains(&"test".into()));
        let names = targets.iter().filter(is_test).filter_map(|target| target["name"].as_str());
        Ok(Crate {
            name: package["name"].as_str().context("a package without a name")?.to_owned(),
            folder: manifest.trim_end_matches("Cargo.toml").to_owned(),
            test_binaries: names.map(str::to_owned).collect(),
        })
    };
    packages.iter().zip(manifests).map(member).collect()
}

/// Crates with more than one integration-test binary. Each is linked with all of its dependencies,
/// which takes long.
pub fn one_test_binary(crates: &[Crate]) -> Vec<Finding> {
    let mut findings = Vec::new();
    for member in crates {
        let excepted = |name: &&String| {
            MORE_TEST_BINARIES
                .iter()
                .any(|(package, binary, _)| *package == member.name && *binary == name.as_str())
        };
        let names: Vec<&str> =
            member.test_binaries.iter().filter(|name| !excepted(name)).map(String::as_str).collect();
        if names.len() > 1 {
            let message = format!("has {} integration-test binaries: {}", names.len(), names.join(", "));
            findings.push(Finding::failure(&format!("{}Cargo.toml", member.folder), 0, message));
        }
    }
    findings
}

/// Modules and included files from another crate. The other crate should offer them.
pub fn files_of_other_crates(source: &Source, crates: &[Crate]) -> Vec<Finding> {
    let Some(own) = owner(&source.path, crates) else { return Vec::new() };
    let mut findings = Vec::new();
    for (index, line) in source.lines.iter().enumerate().filter(|(_, line)| names_a_module_file(line)) {
        for path in line.literals.split('"').filter(|path| path.ends_with(".rs")) {
            let target = resolve(&source.path, path);
            if owner(&target, crates).is_none_or(|other| other.name != own.name) {
                let message =
                    format!("`#[path]` uses `{target}` of another crate: use that crate or the test kit");
                findings.push(Finding::failure(&source.path, index + 1, message));
            }
        }
    }
    findings
}

fn names_a_module_file(line: &Line) -> bool {
    let code: String = line.code.split_whitespace().collect();
    code.contains("#[path=") || (code.contains("#[cfg_attr(") && code.contains(",path="))
}

/// Code for builds without a feature, in a crate whose tests never run without default features.
pub fn tested_without_features(source: &Source, crates: &[Crate]) -> Vec<Finding> {
    let Some(own) = owner(&source.path, crates) else { return Vec::new() };
    let is_off = |line: &Line| line.code.split_whitespace().collect::<String>().contains("not(feature=");
    let Some(index) = source.lines.iter().position(is_off) else { return Vec::new() };
    if default_features::is_tested(&own.name) {
        return Vec::new();
    }
    let message = format!(
        "`not(feature = …)` is never tested: add `{}` to the table in `xtask/src/default_features.rs`",
        own.name
    );
    vec![Finding::failure(&source.path, index + 1, message)]
}

/// The crate with the longest folder that holds the path.
fn owner<'a>(path: &str, crates: &'a [Crate]) -> Option<&'a Crate> {
    let holds = |member: &&Crate| path.starts_with(&member.folder);
    crates.iter().filter(holds).max_by_key(|member| member.folder.len())
}

/// The path from the root of a path that is relative to the folder of `source`.
fn resolve(source: &str, path: &str) -> String {
    let mut parts: Vec<&str> = source.split('/').collect();
    parts.pop();
    for part in path.split('/') {
        match part {
            "." => {}
            ".." => drop(parts.pop()),
            name => parts.push(name),
        }
    }
    parts.join("/")
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn crates() -> Vec<Crate> {
        let member = |name: &str, folder: &str, binaries: &[&str]| Crate {
            name: name.to_owned(),
            folder: folder.to_owned(),
            test_binaries: binaries.iter().map(|&name| name.to_owned()).collect(),
        };
        vec![
            member("cutis", "crates/cutis/", &["all"]),
            member("cutis-solver-cpu", "crates/cutis-solver-cpu/", &["all", "allocations"]),
            member("cutis-mesh", "crates/cutis-mesh/", &["cut", "lattice"]),
            member("cutis-tests", "tests/", &["all"]),
            member("cutis-test-kit", "tests/kit/", &[]),
        ]
    }

    fn count(rule: fn(&Source, &[Crate]) -> Vec<Finding>, path: &str, text: &str) -> usize {
        rule(&Source::parse(path, text), &crates()).len()
    }

    #[test]
    fn a_second_test_binary_is_caught_unless_it_is_listed() {
        let findings = one_test_binary(&crates());
        assert_eq!(findings.len(), 1, "{findings:?}");
        assert_eq!(findings[0].place, "crates/cutis-mesh/Cargo.toml");
        assert!(findings[0].message.contains("cut, lattice"));
    }

    #[test]
    fn modules_of_other_crates_are_caught() {
        let from_mesh = |text: &str| count(files_of_other_crates, "crates/cutis-mesh/tests/cut.rs", text);
        assert_eq!(from_mesh("#[path = \"../../cutis/tests/scans.rs\"]\nmod scans;\n"), 1);
        assert_eq!(from_mesh("#[cfg_attr(test, path = \"../../../tests/kit/src/gpu.rs\")]\nmod gpu;\n"), 1);
        assert_eq!(from_mesh("#[path = \"../src/lattice.rs\"]\nmod lattice;\n"), 0);
        assert_eq!(
            from_mesh("let path = \"../../cutis/tests/scans.rs\"; // #[path = \"../../../x.rs\"]\n"),
            0
        );
        let kit = "#[path = \"kit/src/gpu.rs\"]\nmod gpu;\n";
        assert_eq!(count(files_of_other_crates, "tests/all.rs", kit), 1);
    }

    #[test]
    fn code_without_a_feature_needs_a_step() {
        let text = "#![cfg(not(feature = \"gpu\"))]\n";
        assert_eq!(count(tested_without_features, "crates/cutis/tests/a.rs", text), 0);
        assert_eq!(count(tested_without_features, "crates/cutis-mesh/src/a.rs", text), 1);
        let other = "// not(feature = \"gpu\")\n#![cfg(feature = \"gpu\")]\nlet a = \"not(feature = 1)\";\n";
        assert_eq!(count(tested_without_features, "crates/cutis-mesh/src/a.rs", other), 0);
    }

    #[test]
    fn members_come_from_the_metadata() {
        let metadata = json!({ "packages": [{ "name": "a", "targets": [
            { "kind": ["lib"], "name": "a" }, { "kind": ["test"], "name": "all" }, { "kind": ["bench"], "name": "b" }
        ] }] });
        let found = members(&metadata, &["crates/a/Cargo.toml".to_owned()]).unwrap();
        assert_eq!(
            (found[0].folder.as_str(), found[0].test_binaries.as_slice()),
            ("crates/a/", &["all".to_owned()][..])
        );
    }
}
