//! Installs the program from its package, as `cargo install cutis-cli` does, and runs it where
//! there is no checkout.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail};

use crate::workspace::{Workspace, execute};

/// Small enough for a program that is not optimized. There the pictures alone would take minutes.
const SMALL_DEMO: [&str; 10] = [
    "demo",
    "--set",
    "volume.phantom={size=[96,96,64],seed=1}",
    "--set",
    "lattice.spacing_mm=16",
    "--set",
    "output={report=true,surface=true,volume=true}",
    "--frames",
    "3",
    "--json",
];

/// Installs the unpacked package in `package`, which has the files of the package and no others,
/// and runs the demo in an empty folder.
///
/// Cargo builds without optimization, because one short run gains less than the build costs.
pub fn try_package(workspace: &Workspace, package: &Path, version: &str) -> Result<()> {
    let root = workspace.target_dir()?.join("installed");
    if root.exists() {
        fs::remove_dir_all(&root).with_context(|| root.display().to_string())?;
    }
    let mut command = workspace.command(Workspace::cargo_program());
    command.args(["install", "--debug", "--quiet", "--force", "--path"]).arg(package);
    command.arg("--root").arg(&root).env("CARGO_TARGET_DIR", workspace.target_dir()?);
    // Not in the checkout: cargo would read its `.cargo/config.toml`.
    command.current_dir(package).env("CARGO_PROFILE_DEV_OPT_LEVEL", "0");
    execute(&mut command)?;
    let program = root.join(format!("bin/cutis{}", std::env::consts::EXE_SUFFIX));
    let empty = root.join("empty");
    fs::create_dir_all(&empty).with_context(|| empty.display().to_string())?;
    try_program(workspace, &program, &empty, version)
}

/// Runs the demo of `program` in `folder` and checks the version and the wound in its report.
pub fn try_program(workspace: &Workspace, program: &Path, folder: &Path, version: &str) -> Result<()> {
    let output = workspace.command(program).args(SMALL_DEMO).current_dir(folder).output();
    let output = output.with_context(|| format!("cannot start {}", program.display()))?;
    if !output.status.success() {
        bail!("{} failed: {}", program.display(), String::from_utf8_lossy(&output.stderr).trim());
    }
    check_report(&output.stdout, version)?;
    for file in ["report.html", "report.json", "skin.vtu", "deformed.nii.gz"] {
        let path = folder.join("cutis-demo").join(file);
        if !fs::metadata(&path).is_ok_and(|found| found.len() > 0) {
            bail!("{} is missing or empty", path.display());
        }
    }
    println!("{} {version} runs the demo", program.display());
    Ok(())
}

/// The report is of this version, and its wound opened.
fn check_report(json: &[u8], version: &str) -> Result<()> {
    let report: serde_json::Value = serde_json::from_slice(json).context("the report is not JSON")?;
    if report["cutis_version"] != version {
        bail!("the report says version {}, not {version}", report["cutis_version"]);
    }
    match report["wound"]["final_mm"].as_f64() {
        Some(opening) if opening > 0.0 => Ok(()),
        _ => bail!("the wound of the demo did not open: {}", report["wound"]),
    }
}

#[cfg(test)]
mod tests {
    use super::check_report;

    #[test]
    fn another_version_and_a_closed_wound_are_failures() {
        let check = |text: &str| check_report(text.as_bytes(), "0.2.0").map_err(|error| error.to_string());
        let report = r#"{"cutis_version": "0.2.0", "wound": {"final_mm": 3.5}}"#;
        assert_eq!(check(report), Ok(()));
        assert!(check(&report.replace("0.2.0", "0.1.0")).unwrap_err().contains("0.1.0"));
        assert!(check(&report.replace("3.5", "0.0")).unwrap_err().contains("did not open"));
        assert!(check("no report").is_err());
    }
}
