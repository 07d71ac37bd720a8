//! `cargo xtask publish --dry-run`: packs every publishable crate, compiles each from its package,
//! and installs the program from its package. The step `publish` of the tests leaves out the
//! installation, which builds all dependencies once more.
//!
//! `cargo publish --dry-run` can compile packages too. But it unpacks them into cargo's home folder
//! and reuses the packages of an earlier run, because name and version are the same. So this module
//! unpacks them into the target folder and compiles them there.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use serde_json::Value;

use crate::installed;
use crate::workspace::{Scope, Workspace, execute};

/// The crate of the program.
const PROGRAM: &str = "cutis-cli";

/// Name and version of a crate.
struct Package {
    name: String,
    version: String,
}

impl Package {
    fn folder(&self) -> String {
        format!("{}-{}", self.name, self.version)
    }
}

/// Packs and compiles every crate, and installs the program from its package.
pub fn dry_run(workspace: &Workspace) -> Result<()> {
    let (folder, packages) = packed(workspace)?;
    let program = packages.iter().find(|package| package.name == PROGRAM).context("no program is packed")?;
    installed::try_package(workspace, &folder.join(program.folder()), &program.version)
}

/// Packs and compiles every crate.
pub fn pack(workspace: &Workspace) -> Result<()> {
    packed(workspace).map(|_| ())
}

/// Packs and compiles every crate. Returns the packages and the folder where they are unpacked.
/// Outside CI the checkout may have changes that are not committed.
fn packed(workspace: &Workspace) -> Result<(PathBuf, Vec<Package>)> {
    let target = workspace.target_dir()?;
    let root = workspace.root.join("Cargo.toml");
    let packages = publishable(&workspace.metadata(&root, Scope::Members)?)?;
    let mut command = workspace.cargo("package");
    command.args(["--no-verify", "--quiet"]);
    command.args(packages.iter().flat_map(|package| ["--package", package.name.as_str()]));
    if !workspace.ci {
        command.arg("--allow-dirty");
    }
    execute(&mut command)?;

    let folder = target.join("unpacked-packages");
    unpack(workspace, &packages, &target.join("package"), &folder)?;
    let manifest = folder.join("Cargo.toml");
    let root_manifest = fs::read_to_string(&root).context("Cargo.toml")?;
    fs::write(&manifest, workspace_manifest(&packages, &root_manifest)?)?;
    fs::copy(workspace.root.join("Cargo.lock"), folder.join("Cargo.lock")).context("Cargo.lock")?;
    for package in &packages {
        // Without `--locked`: cargo removes the unpublished crates from the copy of the lock file.
        let mut command = workspace.command(Workspace::cargo_program());
        command.args(["check", "--quiet", "--package", &package.name, "--manifest-path"]).arg(&manifest);
        execute(command.env("CARGO_TARGET_DIR", &target))?;
    }
    println!("{} crates compile from their packages", packages.len());
    Ok((folder, packages))
}

/// The members of the workspace without `publish = false`.
fn publishable(metadata: &Value) -> Result<Vec<Package>> {
    let packages = metadata["packages"].as_array().context("cargo metadata lists no packages")?;
    let published = packages.iter().filter(|package| package["publish"] != Value::Array(Vec::new()));
    let package = |package: &Value| {
        let text = |key: &str| package[key].as_str().map(str::to_owned);
        let (name, version) = text("name").zip(text("version")).context("a package without a name")?;
        Ok(Package { name, version })
    };
    published.map(package).collect()
}

/// Unpacks every `.crate` file of `from` into the empty folder `to`.
fn unpack(workspace: &Workspace, packages: &[Package], from: &Path, to: &Path) -> Result<()> {
    if to.exists() {
        fs::remove_dir_all(to).with_context(|| to.display().to_string())?;
    }
    fs::create_dir_all(to).with_context(|| to.display().to_string())?;
    for package in packages {
        // `m` gives the files the current time. Cargo packs all files with the same old time and
        // would not see that they changed.
        let archive = from.join(format!("{}.crate", package.folder()));
        let status = workspace.command("tar").arg("-xzmf").arg(&archive).arg("-C").arg(to).status();
        if !status.context("cannot start tar")?.success() {
            bail!("tar cannot unpack {}", archive.display());
        }
    }
    Ok(())
}

/// A manifest under which the unpacked crates depend on each other, with the profiles of the
/// checkout, so that cargo does not compile other dependencies again.
fn workspace_manifest(packages: &[Package], root_manifest: &str) -> Result<String> {
    let root: toml::Table = root_manifest.parse().context("Cargo.toml is not TOML")?;
    let folders = packages.iter().map(|package| toml::Value::String(package.folder())).collect();
    let patches = packages.iter().map(|package| {
        let path = toml::Table::from_iter([("path".to_owned(), toml::Value::String(package.folder()))]);
        (package.name.clone(), toml::Value::Table(path))
    });
    let mut manifest: toml::Table =
        "[workspace]\nresolver = \"3\"\nmembers = []\n[patch.crates-io]\n".parse()?;
    manifest["workspace"]["members"] = toml::Value::Array(folders);
    manifest["patch"]["crates-io"] = toml::Value::Table(patches.collect());
    if let Some(profiles) = root.get("profile") {
        manifest.insert("profile".to_owned(), profiles.clone());
    }
    Ok(manifest.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn unpublished_crates_are_not_packed() {
        let metadata = json!({ "packages": [
            { "name": "a", "version": "0.1.0", "publish": null },
            { "name": "tests", "version": "0.1.0", "publish": [] },
        ] });
        let folders: Vec<String> = publishable(&metadata).unwrap().iter().map(Package::folder).collect();
        assert_eq!(folders, ["a-0.1.0"]);
    }

    #[test]
    fn unpacked_crates_replace_those_of_the_registry() {
        let packages = [Package { name: "a".to_owned(), version: "0.1.0".to_owned() }];
        let text = workspace_manifest(&packages, "[profile.dev]\nopt-level = 2\n").unwrap();
        let manifest: toml::Table = text.parse().unwrap();
        assert_eq!(manifest["workspace"]["members"][0].as_str(), Some("a-0.1.0"));
        assert_eq!(manifest["patch"]["crates-io"]["a"]["path"].as_str(), Some("a-0.1.0"));
        assert_eq!(manifest["profile"]["dev"]["opt-level"].as_integer(), Some(2));
        assert!(workspace_manifest(&packages, "not TOML").is_err());
    }
}
