//! `cargo xtask licenses`: holds `deny.toml` (licenses, bans, sources) against every resolved dependency. It needs no
//! tool beyond cargo; `cargo deny check` reads the same file and adds the advisories.

use std::collections::BTreeSet;

use anyhow::{Context, Result, bail};
use serde_json::Value;

use crate::spdx;
use crate::workspace::{Scope, Workspace};

struct Rules {
    allowed_licenses: Vec<String>,
    banned: Vec<(String, String)>,
    registries: Vec<String>,
}

impl Rules {
    fn parse(text: &str) -> Result<Self> {
        let table: toml::Table = text.parse().context("deny.toml is not TOML")?;
        let list = |section: &str, key: &str| -> Result<Vec<toml::Value>> {
            let value = table.get(section).and_then(|section| section.get(key));
            Ok(value
                .and_then(|value| value.as_array())
                .with_context(|| format!("deny.toml: [{section}] has no list `{key}`"))?
                .clone())
        };
        let strings = |values: Vec<toml::Value>| {
            values.iter().filter_map(|value| value.as_str().map(str::to_owned)).collect()
        };
        let mut banned = Vec::new();
        for entry in list("bans", "deny")? {
            let text = |key: &str| entry.get(key).and_then(|value| value.as_str()).map(str::to_owned);
            let name = text("crate").context("deny.toml: an entry of [bans] deny has no `crate`")?;
            let reason =
                text("reason").with_context(|| format!("deny.toml: the ban of `{name}` has no `reason`"))?;
            banned.push((name, reason));
        }
        Ok(Self {
            allowed_licenses: strings(list("licenses", "allow")?),
            banned,
            registries: strings(list("sources", "allow-registry")?),
        })
    }

    /// What is wrong with one package of `cargo metadata`.
    fn complaints(&self, package: &Value) -> Vec<String> {
        let name = package["name"].as_str().unwrap_or("?");
        let label = format!("{name} {}", package["version"].as_str().unwrap_or("?"));
        let mut complaints = Vec::new();
        match (package["license"].as_str(), package["source"].as_str()) {
            (Some(license), _) => match spdx::satisfied(license, &self.allowed_licenses) {
                Ok(true) => {}
                Ok(false) => {
                    complaints.push(format!("{label}: license `{license}` is not allowed by deny.toml"))
                }
                Err(error) => complaints.push(format!("{label}: license `{license}`: {error}")),
            },
            (None, None) if package["publish"] == Value::Array(Vec::new()) => {} // our own and never published
            (None, _) => complaints.push(format!("{label}: no license is stated")),
        }
        if let Some((_, reason)) = self.banned.iter().find(|(banned, _)| banned == name) {
            complaints.push(format!("{label}: banned by deny.toml: {reason}"));
        }
        if let Some(source) = package["source"].as_str() {
            let registry = source.strip_prefix("registry+");
            if !registry.is_some_and(|registry| self.registries.iter().any(|allowed| allowed == registry)) {
                complaints.push(format!("{label}: comes from `{source}`, which deny.toml does not allow"));
            }
        }
        complaints
    }
}

/// Checks every workspace.
pub fn run(workspace: &Workspace) -> Result<()> {
    let rules =
        Rules::parse(&std::fs::read_to_string(workspace.root.join("deny.toml")).context("deny.toml")?)?;
    let mut complaints = BTreeSet::new();
    let mut count = 0;
    for manifest in workspace.manifests() {
        let metadata = workspace.metadata(&manifest, Scope::AllDependencies)?;
        let packages = metadata["packages"].as_array().context("cargo metadata lists no packages")?;
        count += packages.len();
        complaints.extend(packages.iter().flat_map(|package| rules.complaints(package)));
    }
    if !complaints.is_empty() {
        let complaints: Vec<String> = complaints.into_iter().collect();
        bail!("{}", complaints.join("\n       "));
    }
    println!("licenses, bans and sources of {count} packages are as deny.toml wants them");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    const REGISTRY: &str = "https://github.com/rust-lang/crates.io-index";

    fn rules() -> Rules {
        Rules::parse(&format!(
            r#"
            [licenses]
            allow = ["MIT"]
            [bans]
            deny = [{{ crate = "left-pad", reason = "three lines" }}]
            [sources]
            allow-registry = ["{REGISTRY}"]
            "#
        ))
        .unwrap()
    }

    fn package(name: &str, license: Value, source: &str) -> Value {
        json!({ "name": name, "version": "1.0.0", "license": license, "source": source })
    }

    #[test]
    fn an_allowed_package_passes() {
        let source = format!("registry+{REGISTRY}");
        assert!(rules().complaints(&package("fine", json!("MIT"), &source)).is_empty());
    }

    #[test]
    fn each_rule_catches_its_violation() {
        let source = format!("registry+{REGISTRY}");
        for (package, word) in [
            (package("fine", json!("GPL-3.0-only"), &source), "GPL-3.0-only"),
            (package("fine", Value::Null, &source), "no license"),
            (package("left-pad", json!("MIT"), &source), "three lines"),
            (package("fine", json!("MIT"), "git+https://example.org/fine"), "git+"),
        ] {
            let complaints = rules().complaints(&package);
            assert_eq!(complaints.len(), 1, "{complaints:?}");
            assert!(complaints[0].contains(word), "{complaints:?}");
        }
    }

    #[test]
    fn a_ban_without_a_reason_is_an_error() {
        let text =
            "[licenses]\nallow = []\n[bans]\ndeny = [{ crate = \"x\" }]\n[sources]\nallow-registry = []";
        assert!(Rules::parse(text).err().unwrap().to_string().contains("reason"));
    }
}
