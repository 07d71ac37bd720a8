//! The layers of the workspace: a crate depends only on crates of lower layers that its row names.

use anyhow::{Context, Result};
use serde_json::Value;

use super::Finding;

/// One crate of the table.
struct Layer {
    name: &'static str,
    level: u8,
    may_use: MayUse,
}

/// The crates of lower layers that a crate may depend on.
enum MayUse {
    These(&'static [&'static str]),
    AnyBelow,
}

use MayUse::{AnyBelow, These};

/// The table of `docs/ARCHITECTURE.md`. A new crate gets a row here first.
const LAYERS: &[Layer] = &[
    Layer { name: "cutis-coloring", level: 0, may_use: These(&[]) },
    Layer { name: "cutis-shaders", level: 0, may_use: These(&[]) },
    Layer { name: "cutis-volume", level: 1, may_use: These(&[]) },
    Layer { name: "cutis-constraints", level: 1, may_use: These(&["cutis-shaders"]) },
    Layer { name: "cutis-gpu", level: 1, may_use: These(&[]) },
    Layer { name: "cutis-mesh", level: 2, may_use: These(&["cutis-volume"]) },
    Layer { name: "cutis-solver", level: 2, may_use: These(&["cutis-constraints", "cutis-coloring"]) },
    Layer {
        name: "cutis-solver-cpu",
        level: 3,
        may_use: These(&["cutis-solver", "cutis-constraints", "cutis-coloring"]),
    },
    Layer {
        name: "cutis-solver-gpu",
        level: 3,
        may_use: These(&[
            "cutis-solver",
            "cutis-constraints",
            "cutis-coloring",
            "cutis-gpu",
            "cutis-shaders",
        ]),
    },
    Layer {
        name: "cutis-chainmail",
        level: 3,
        may_use: These(&["cutis-volume", "cutis-gpu", "cutis-shaders"]),
    },
    Layer {
        name: "cutis-rest",
        level: 3,
        may_use: These(&[
            "cutis-solver",
            "cutis-constraints",
            "cutis-coloring",
            "cutis-gpu",
            "cutis-shaders",
        ]),
    },
    Layer { name: "cutis-newton", level: 3, may_use: These(&["cutis-solver", "cutis-constraints"]) },
    Layer { name: "cutis-skin", level: 3, may_use: These(&["cutis-volume", "cutis-mesh"]) },
    Layer {
        name: "cutis-resample",
        level: 3,
        may_use: These(&["cutis-constraints", "cutis-volume", "cutis-mesh", "cutis-gpu", "cutis-shaders"]),
    },
    Layer {
        name: "cutis-render",
        level: 3,
        may_use: These(&["cutis-volume", "cutis-mesh", "cutis-gpu", "cutis-shaders"]),
    },
    Layer {
        name: "cutis-conformance",
        level: 4,
        may_use: These(&[
            "cutis-solver-cpu",
            "cutis-solver-gpu",
            "cutis-solver",
            "cutis-constraints",
            "cutis-coloring",
            "cutis-gpu",
            "cutis-shaders",
        ]),
    },
    Layer { name: "cutis", level: 5, may_use: AnyBelow },
    Layer { name: "cutis-cli", level: 6, may_use: AnyBelow },
];

/// Crates that help with tests. The tests of a product crate may use them.
const TEST_HELPERS: &[&str] = &["cutis-test-kit", "cutis-resample-twin"];

/// Tests and studies. They may use any crate, and no product crate uses them.
const TESTS_AND_STUDIES: &[&str] = &["cutis-fuzz", "cutis-studies", "cutis-tests"];

/// Whether the crate is for tests and studies, which are not published.
fn is_unpublished(name: &str) -> bool {
    TEST_HELPERS.contains(&name) || TESTS_AND_STUDIES.contains(&name)
}

/// The facts about a workspace member that the rule needs.
#[derive(Debug)]
pub struct Package {
    name: String,
    publish: bool,
    /// Names of normal and build dependencies.
    dependencies: Vec<String>,
    /// Names of the dependencies of its tests, examples and benchmarks.
    dev_dependencies: Vec<String>,
}

impl Package {
    /// Name of the crate.
    pub fn name(&self) -> &str {
        &self.name
    }
}

/// The members of the workspace, from `cargo metadata --no-deps`.
pub fn packages(metadata: &Value) -> Result<Vec<Package>> {
    let packages = metadata["packages"].as_array().context("cargo metadata lists no packages")?;
    packages
        .iter()
        .map(|package| {
            let dependencies =
                package["dependencies"].as_array().context("a package without dependencies")?;
            let names = |dev: bool| {
                let of_kind = dependencies.iter().filter(|dependency| (dependency["kind"] == "dev") == dev);
                of_kind.filter_map(|dependency| dependency["name"].as_str().map(str::to_owned)).collect()
            };
            Ok(Package {
                name: package["name"].as_str().context("a package without a name")?.to_owned(),
                publish: package["publish"] != Value::Array(Vec::new()),
                dependencies: names(false),
                dev_dependencies: names(true),
            })
        })
        .collect()
}

/// Finds dependencies that do not point down, crates without a row, and rows without a crate.
pub fn check(packages: &[Package]) -> Vec<Finding> {
    let mut findings = Vec::new();
    for package in packages.iter().filter(|package| is_unpublished(&package.name) && package.publish) {
        findings.push(Finding::failure(&package.name, 0, "must not be published: set `publish = false`"));
    }
    for package in packages.iter().filter(|package| !is_unpublished(&package.name)) {
        let Some(from) = find(&package.name) else {
            findings.push(Finding::failure(&package.name, 0, "has no row in the table of layers"));
            continue;
        };
        for dependency in &package.dependencies {
            if packages.iter().any(|other| other.name == *dependency)
                && let Some(complaint) = complaint(from, dependency)
            {
                findings.push(Finding::failure(&package.name, 0, complaint));
            }
        }
        for dependency in &package.dev_dependencies {
            if TESTS_AND_STUDIES.contains(&dependency.as_str()) {
                let message =
                    format!("the tests use `{dependency}`; only {TEST_HELPERS:?} are for all crates");
                findings.push(Finding::failure(&package.name, 0, message));
            }
        }
    }
    for row in LAYERS.iter().filter(|row| packages.iter().all(|package| package.name != row.name)) {
        findings.push(Finding::failure(
            row.name,
            0,
            "has a row in the table of layers but is no crate of the workspace",
        ));
    }
    findings
}

fn complaint(from: &Layer, dependency: &str) -> Option<String> {
    let Some(to) = find(dependency) else {
        return Some(format!("depends on `{dependency}`, which is in no layer"));
    };
    if to.level >= from.level {
        return Some(format!(
            "layer {} depends on `{dependency}` of layer {}: arrows point down",
            from.level, to.level
        ));
    }
    match from.may_use {
        These(names) if !names.contains(&dependency) => {
            Some(format!("depends on `{dependency}`, which is not among {names:?}"))
        }
        _ => None,
    }
}

fn find(name: &str) -> Option<&'static Layer> {
    LAYERS.iter().find(|row| row.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// The crates of the table. Only `name` has dependencies.
    fn with(name: &str, dependencies: &[&str]) -> Vec<Package> {
        let dependencies: Vec<String> =
            dependencies.iter().map(|&dependency| dependency.to_owned()).collect();
        let names = LAYERS.iter().map(|row| row.name).chain((find(name).is_none()).then_some(name));
        names
            .map(|member| Package {
                name: member.to_owned(),
                publish: true,
                dependencies: if member == name { dependencies.clone() } else { Vec::new() },
                dev_dependencies: Vec::new(),
            })
            .collect()
    }

    #[test]
    fn the_table_itself_points_down() {
        for row in LAYERS {
            if let These(names) = row.may_use {
                assert!(
                    names.iter().all(|name| find(name).is_some_and(|to| to.level < row.level)),
                    "{}",
                    row.name
                );
            }
        }
    }

    #[test]
    fn downward_arrows_and_foreign_crates_pass() {
        assert_eq!(check(&with("cutis-mesh", &["cutis-volume", "rayon"])), []);
        assert_eq!(check(&with("cutis-cli", &["cutis", "cutis-volume"])), []);
    }

    #[test]
    fn wrong_arrows_are_caught() {
        for (name, dependency) in [
            ("cutis-volume", "cutis-mesh"),     // up
            ("cutis-render", "cutis-resample"), // sideways
            ("cutis-mesh", "cutis-coloring"),   // down, but not named
            ("cutis-constraints", "cutis"),     // far up
        ] {
            assert_eq!(check(&with(name, &[dependency])).len(), 1, "{name} -> {dependency}");
        }
    }

    #[test]
    fn unknown_and_missing_crates_are_caught() {
        assert_eq!(check(&with("cutis-new", &[])).len(), 1);
        let mut packages = with("cutis", &[]);
        packages.retain(|package| package.name != "cutis-mesh");
        assert_eq!(check(&packages).len(), 1);
    }

    #[test]
    fn only_tests_may_use_the_test_helpers() {
        let mut packages = with("cutis-mesh", &[]);
        let mesh = packages.iter().position(|package| package.name == "cutis-mesh").unwrap();
        packages.push(Package {
            name: TEST_HELPERS[0].to_owned(),
            publish: false,
            dependencies: Vec::new(),
            dev_dependencies: Vec::new(),
        });
        packages[mesh].dev_dependencies = vec![TEST_HELPERS[0].to_owned()];
        assert_eq!(check(&packages), []);
        packages[mesh].dev_dependencies = vec!["cutis-studies".to_owned()];
        assert_eq!(check(&packages).len(), 1);
        packages[mesh].dev_dependencies.clear();
        packages[mesh].dependencies = vec![TEST_HELPERS[0].to_owned()];
        assert_eq!(check(&packages).len(), 1);
    }

    #[test]
    fn no_product_crate_uses_unpublished_crates() {
        let mut packages = with("cutis", &[TESTS_AND_STUDIES[0]]);
        packages.push(Package {
            name: TESTS_AND_STUDIES[0].to_owned(),
            publish: false,
            dependencies: vec!["cutis".to_owned()],
            dev_dependencies: Vec::new(),
        });
        assert_eq!(check(&packages).len(), 1);
        packages.last_mut().unwrap().publish = true;
        assert_eq!(check(&packages).len(), 2);
    }

    #[test]
    fn dev_dependencies_are_kept_apart() {
        let metadata = json!({ "packages": [{ "name": "a", "publish": null, "dependencies": [
            { "name": "normal", "kind": null }, { "name": "build", "kind": "build" }, { "name": "dev", "kind": "dev" }
        ] }] });
        let packages = packages(&metadata).unwrap();
        assert_eq!(packages[0].dependencies, ["normal", "build"]);
        assert_eq!(packages[0].dev_dependencies, ["dev"]);
        assert!(packages[0].publish);
    }
}
