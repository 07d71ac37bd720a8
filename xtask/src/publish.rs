//! `cargo xtask publish --dry-run`: packages every publishable crate and builds each from its package.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::workspace::{Scope, Workspace, execute};

/// Outside CI a dirty checkout is allowed.
pub fn dry_run(workspace: &Workspace) -> Result<()> {
    if let Some(home) = cargo_home() {
        forget_earlier_trials(&home, &packages(workspace)?)?;
    }
    let mut command = workspace.cargo("publish");
    // Nothing of what is built is run: debug information would be a quarter of the time.
    command.args(["--workspace", "--dry-run", "--quiet"]).env("CARGO_PROFILE_DEV_DEBUG", "false");
    if !workspace.ci {
        command.arg("--allow-dirty");
    }
    execute(&mut command)
}

/// Removes what cargo unpacked of these packages in earlier trials.
///
/// A trial packs the crates into a registry in the target folder and unpacks them from there into cargo's home, where it takes
/// a package of the same name and version for the same: the next trial would build against the sources of the last one.
/// Folders of such registries begin with a dash, since a path has no host; a real registry's do not.
fn forget_earlier_trials(home: &Path, packages: &[String]) -> Result<()> {
    let Ok(registries) = fs::read_dir(home.join("registry/src")) else { return Ok(()) };
    for registry in registries {
        let registry = registry?;
        if !registry.file_name().to_string_lossy().starts_with('-') {
            continue;
        }
        for package in packages {
            let folder = registry.path().join(package);
            if folder.is_dir() {
                fs::remove_dir_all(&folder).with_context(|| folder.display().to_string())?;
            }
        }
    }
    Ok(())
}

/// Name and version of each member, joined by a dash.
fn packages(workspace: &Workspace) -> Result<Vec<String>> {
    let metadata = workspace.metadata(&workspace.root.join("Cargo.toml"), Scope::Members)?;
    let packages = metadata["packages"].as_array().context("cargo metadata lists no packages")?;
    let name = |package: &serde_json::Value| {
        Some(format!("{}-{}", package["name"].as_str()?, package["version"].as_str()?))
    };
    Ok(packages.iter().filter_map(name).collect())
}

fn cargo_home() -> Option<PathBuf> {
    std::env::var_os("CARGO_HOME").map(PathBuf::from).or_else(|| Some(std::env::home_dir()?.join(".cargo")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_of_an_earlier_trial_go_and_others_stay() {
        let home = std::env::temp_dir().join(format!("cutis-xtask-publish-{}", std::process::id()));
        let folder = |registry: &str, package: &str| home.join("registry/src").join(registry).join(package);
        let all = [
            folder("-0123", "cutis-mesh-0.1.0"),
            folder("-0123", "other-1.0.0"),
            folder("index.crates.io-0123", "cutis-mesh-0.1.0"),
        ];
        all.iter().for_each(|folder| fs::create_dir_all(folder).unwrap());
        forget_earlier_trials(&home, &["cutis-mesh-0.1.0".into()]).unwrap();
        assert_eq!(all.each_ref().map(|folder| folder.exists()), [false, true, true]);
        fs::remove_dir_all(&home).unwrap();
        forget_earlier_trials(&home, &["cutis-mesh-0.1.0".into()]).unwrap();
    }
}
