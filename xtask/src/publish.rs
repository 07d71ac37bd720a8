//! `cargo xtask publish --dry-run`: packages every publishable crate and builds each from its package.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::workspace::{Scope, Workspace, execute};

/// Outside CI a dirty checkout is allowed.
pub fn dry_run(workspace: &Workspace) -> Result<()> {
    if let Some(home) = cargo_home() {
        forget_unpacked(&home, &packages(workspace)?)?;
    }
    forget_built(&workspace.target_dir()?.join("debug"))?;
    let mut command = workspace.cargo("publish");
    // Nothing of what is built is run: debug information would be a quarter of the time.
    command.args(["--workspace", "--dry-run", "--quiet"]).env("CARGO_PROFILE_DEV_DEBUG", "false");
    if !workspace.ci {
        command.arg("--allow-dirty");
    }
    execute(&mut command)
}

/// Part of the path of a source that was unpacked from a registry in a folder: its name begins with a dash, since a path has no
/// host.
const TRIAL: &str = "/registry/src/-";

/// Removes what cargo unpacked of these packages in earlier trials.
///
/// A trial packs the crates into a registry in the target folder and unpacks them from there into cargo's home, where it takes
/// a package of the same name and version for the same: the next trial would build against the sources of the last one.
fn forget_unpacked(home: &Path, packages: &[String]) -> Result<()> {
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

/// Makes cargo build again what it built in earlier trials: for it, a package from a registry never changes.
fn forget_built(profile: &Path) -> Result<()> {
    let Ok(files) = fs::read_dir(profile.join("deps")) else { return Ok(()) };
    for file in files {
        let path = file?.path();
        let Some(stem) = path.file_stem().and_then(|stem| stem.to_str()) else { continue };
        if path.extension() != Some("d".as_ref()) || !stem.starts_with("cutis_") {
            continue;
        }
        let inputs = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        if inputs.replace('\\', "/").contains(TRIAL) {
            let fingerprint = profile.join(".fingerprint").join(stem.replace('_', "-"));
            if fingerprint.is_dir() {
                fs::remove_dir_all(&fingerprint).with_context(|| fingerprint.display().to_string())?;
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

    /// An empty folder that goes when the test ends well.
    fn folder(name: &str) -> PathBuf {
        std::env::temp_dir().join(format!("cutis-xtask-{name}-{}", std::process::id()))
    }

    #[test]
    fn sources_of_an_earlier_trial_go_and_others_stay() {
        let home = folder("unpacked");
        let of = |registry: &str, package: &str| home.join("registry/src").join(registry).join(package);
        let all = [
            of("-0123", "cutis-mesh-0.1.0"),
            of("-0123", "other-1.0.0"),
            of("index.crates.io-0123", "cutis-mesh-0.1.0"),
        ];
        all.iter().for_each(|folder| fs::create_dir_all(folder).unwrap());
        forget_unpacked(&home, &["cutis-mesh-0.1.0".into()]).unwrap();
        assert_eq!(all.each_ref().map(|folder| folder.exists()), [false, true, true]);
        fs::remove_dir_all(&home).unwrap();
        forget_unpacked(&home, &["cutis-mesh-0.1.0".into()]).unwrap();
    }

    #[test]
    fn what_an_earlier_trial_built_goes_and_what_the_workspace_built_stays() {
        let profile = folder("built");
        fs::create_dir_all(profile.join("deps")).unwrap();
        let built = |name: &str, source: &str| {
            let kept = profile.join(".fingerprint").join(name);
            fs::create_dir_all(&kept).unwrap();
            let inputs = profile.join("deps").join(format!("{}.d", name.replace('-', "_")));
            fs::write(inputs, format!("lib.rlib: {source}/src/lib.rs\n")).unwrap();
            kept
        };
        let trial = built("cutis-mesh-01ab", "/home/me/.cargo/registry/src/-0123/cutis-mesh-0.1.0");
        let own = built("cutis-mesh-02cd", "crates/cutis-mesh");
        forget_built(&profile).unwrap();
        assert_eq!([trial.exists(), own.exists()], [false, true]);
        fs::remove_dir_all(&profile).unwrap();
        forget_built(&profile).unwrap();
    }
}
