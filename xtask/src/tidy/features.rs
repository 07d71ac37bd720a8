//! `cargo test --workspace` must enable every feature of every member. Otherwise tests are missing.

use std::collections::BTreeMap;

use anyhow::{Context, Result};
use serde_json::Value;

use super::Finding;

/// Features for other systems. They change nothing on Linux.
const OTHER_SYSTEMS: [&str; 2] = ["metal", "dx12"];

/// Finds features of members that are off when cargo builds the whole workspace with default
/// features. Code behind such a feature is neither linted nor tested, and no message says so.
/// `metadata` must have resolved dependencies.
pub fn switched_off(metadata: &Value) -> Result<Vec<Finding>> {
    let nodes = metadata["resolve"]["nodes"].as_array().context("cargo metadata resolves no dependencies")?;
    let on: BTreeMap<&str, &Value> =
        nodes.iter().filter_map(|node| Some((node["id"].as_str()?, &node["features"]))).collect();
    let packages = metadata["packages"].as_array().context("cargo metadata lists no packages")?;
    let mut findings = Vec::new();
    for package in packages.iter().filter(|package| package["source"].is_null()) {
        let id = package["id"].as_str().context("a package without an id")?;
        let own = on.get(id).and_then(|features| features.as_array());
        let is_on = |name: &str| own.is_some_and(|own| own.iter().any(|feature| feature == name));
        let features = package["features"].as_object().context("a package without features")?;
        // A feature that only turns on others has no code of its own. Those others are checked.
        let only_forwards = |name: &str| {
            let parts = features[name].as_array().map(Vec::as_slice).unwrap_or_default();
            !parts.is_empty()
                && parts.iter().filter_map(Value::as_str).all(|part| match part.split_once('/') {
                    Some((other, feature)) => on.iter().any(|(id, its)| {
                        let has = its.as_array().is_some_and(|its| its.iter().any(|name| name == feature));
                        is_package(id, other) && has
                    }),
                    None => is_on(part),
                })
        };
        for name in features.keys().filter(|name| !OTHER_SYSTEMS.contains(&name.as_str())) {
            if !is_on(name) && !only_forwards(name) {
                let place = package["name"].as_str().unwrap_or(id);
                let message = format!(
                    "feature `{name}` is off in `cargo test --workspace`, so its code is not tested: \
                     switch it on in `tests/Cargo.toml` or by a default feature"
                );
                findings.push(Finding::failure(place, 0, message));
            }
        }
    }
    Ok(findings)
}

/// Whether an id such as `path+file:///folder/a#0.1.0` or `…/folder#a@0.1.0` is that of a
/// package.
fn is_package(id: &str, name: &str) -> bool {
    let (place, version) = id.rsplit_once('#').unwrap_or((id, ""));
    match version.split_once('@') {
        Some((found, _)) => found == name,
        None => place.rsplit('/').next() == Some(name),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn count(source: Value, on: Value) -> usize {
        let metadata = json!({
            "packages": [{
                "id": "a 1.0", "name": "a", "source": source, "features": { "default": ["gpu"], "gpu": [], "metal": [] }
            }],
            "resolve": { "nodes": [{ "id": "a 1.0", "features": on }] }
        });
        switched_off(&metadata).unwrap().len()
    }

    #[test]
    fn a_feature_that_is_off_is_caught() {
        assert_eq!(count(Value::Null, json!(["default", "gpu"])), 0);
        assert_eq!(count(Value::Null, json!(["default"])), 1);
        assert_eq!(count(Value::Null, json!([])), 2);
    }

    #[test]
    fn a_feature_that_only_forwards_to_one_that_is_on_passes() {
        let count = |on: Value| {
            let metadata = json!({
                "packages": [{ "id": "path+file:///b#0.1.0", "name": "b", "source": null, "features": { "more": ["a/x"] } }],
                "resolve": { "nodes": [
                    { "id": "path+file:///b#0.1.0", "features": [] },
                    { "id": "path+file:///a#0.1.0", "features": on }
                ] }
            });
            switched_off(&metadata).unwrap().len()
        };
        assert_eq!(count(json!(["x"])), 0);
        assert_eq!(count(json!([])), 1);
    }

    #[test]
    fn features_of_other_crates_are_not_checked() {
        assert_eq!(count(json!("registry+https://example.org"), json!([])), 0);
    }

    #[test]
    fn metadata_without_dependencies_is_an_error() {
        assert!(switched_off(&json!({ "packages": [], "resolve": null })).is_err());
    }
}
