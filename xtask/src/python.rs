//! `cargo xtask python`: runs the checks of `tests/python`, in an environment with pinned packages
//! in the target folder. The study `peers` has an environment of its own.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::workspace::{Workspace, execute};

/// Runs every check.
pub fn run(workspace: &Workspace) -> Result<()> {
    for script in scripts(&workspace.root.join("tests/python"))? {
        let mut command = check(workspace, &script)?;
        execute(
            command.env("CUTIS_PROGRAM", workspace.program()?).env("CUTIS_STUDY", workspace.study("debug")?),
        )?;
    }
    Ok(())
}

/// The command of one check in the environment, which is created again only if its requirements
/// changed.
pub fn check(workspace: &Workspace, script: &Path) -> Result<Command> {
    let python = environment(workspace, "venv", "tests/python/requirements.txt", all_or_nothing)?;
    let mut command = workspace.command(&python);
    command.arg(script).env("PYTHONDONTWRITEBYTECODE", "1");
    Ok(command)
}

/// The interpreter with the programs of the study `peers`. A program that cannot be installed is
/// reported here, and the study lists it as missing.
pub fn peers(workspace: &Workspace) -> Result<PathBuf> {
    environment(workspace, "venv-peers", "studies/python/requirements.txt", one_by_one)
}

/// The checks: every `*.py` in order of name. They share the `_*.py`, which are not checks.
fn scripts(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut scripts = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let path = entry?.path();
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        if name.ends_with(".py") && !name.starts_with('_') {
            scripts.push(path);
        }
    }
    if scripts.is_empty() {
        bail!("no checks in {}", folder.display());
    }
    scripts.sort();
    Ok(scripts)
}

/// The browsers that `report.py` can use.
const BROWSERS: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];

/// The version of the browser in which `report.html` is checked.
///
/// # Errors
/// There is none. The error says what to install.
pub fn require_browser(workspace: &Workspace) -> Result<String> {
    for browser in BROWSERS {
        if let Ok(output) = workspace.command(browser).arg("--version").output()
            && output.status.success()
        {
            return Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned());
        }
    }
    bail!("Chromium is missing; on Debian: apt-get install -y chromium")
}

/// Installs the packages of a file. Returns whether all of them are installed.
type Install = fn(&Workspace, python: &Path, requirements: &Path) -> Result<bool>;

/// The interpreter of an environment in the target folder, which is created if it is missing or out
/// of date.
fn environment(workspace: &Workspace, name: &str, requirements: &str, install: Install) -> Result<PathBuf> {
    let folder = workspace.target_dir()?.join(name);
    let requirements = workspace.root.join(requirements);
    let wanted = with_included(&requirements)?;
    let version = require(workspace)?;
    let stamp = folder.join("requirements.stamp");
    let wanted_stamp = format!("{version}\n{wanted}");
    let bin = if cfg!(windows) { "Scripts" } else { "bin" };
    let python = folder.join(bin).join("python");
    if std::fs::read_to_string(&stamp).is_ok_and(|found| found == wanted_stamp) && python.exists() {
        return Ok(python);
    }
    execute(workspace.command(PYTHON).args(["-m", "venv", "--clear"]).arg(&folder))
        .context("cannot create a Python environment; on Debian: apt-get install -y python3-venv")?;
    if install(workspace, &python, &requirements)? {
        std::fs::write(&stamp, wanted_stamp).with_context(|| stamp.display().to_string())?;
    }
    Ok(python)
}

/// The text of a file of requirements, and of the files that it includes.
fn with_included(requirements: &Path) -> Result<String> {
    let read = |path: &Path| std::fs::read_to_string(path).with_context(|| path.display().to_string());
    let mut text = read(requirements)?;
    let folder = requirements.parent().unwrap_or(Path::new(""));
    let included: Vec<PathBuf> =
        packages(&text).filter_map(|line| line.strip_prefix("-r ")).map(|path| folder.join(path)).collect();
    for path in included {
        text += &read(&path)?;
    }
    Ok(text)
}

fn pip(workspace: &Workspace, python: &Path) -> Command {
    let mut command = workspace.command(python);
    command.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]);
    command.args(["--only-binary", ":all:"]);
    command
}

fn all_or_nothing(workspace: &Workspace, python: &Path, requirements: &Path) -> Result<bool> {
    execute(pip(workspace, python).arg("-r").arg(requirements)).with_context(|| {
        format!("cannot install the packages of {} (is PyPI reachable?)", requirements.display())
    })?;
    Ok(true)
}

fn one_by_one(workspace: &Workspace, python: &Path, requirements: &Path) -> Result<bool> {
    let mut complete = true;
    for package in packages(&std::fs::read_to_string(requirements)?) {
        if let Err(error) = execute(pip(workspace, python).arg(package)) {
            eprintln!("warning: {package} is not installed: {error:#}");
            complete = false;
        }
    }
    Ok(complete)
}

/// The lines of a file of requirements without comments.
fn packages(text: &str) -> impl Iterator<Item = &str> {
    text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'))
}

/// The name of the interpreter.
pub const PYTHON: &str = if cfg!(windows) { "python" } else { "python3" };

/// The version of the system's Python, such as `Python 3.13.5`.
///
/// # Errors
/// Python or `venv` is missing. The error says what to install.
pub fn require(workspace: &Workspace) -> Result<String> {
    let Ok(output) = workspace.command(PYTHON).arg("--version").output() else {
        bail!("{PYTHON} is missing; on Debian: apt-get install -y python3 python3-venv");
    };
    let complete = workspace.command(PYTHON).args(["-c", "import ensurepip, venv"]).output();
    if !complete.is_ok_and(|output| output.status.success()) {
        bail!(
            "{PYTHON} cannot create environments (venv or pip is missing); on Debian: apt-get install -y python3-venv"
        );
    }
    Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checks_are_found_and_helpers_are_not() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/python");
        let names: Vec<String> = scripts(&folder)
            .unwrap()
            .iter()
            .map(|path| path.file_name().unwrap().to_string_lossy().into_owned())
            .collect();
        let all = ["awkward", "cantilever", "dicom", "formats", "outputs", "report", "slicer", "workflow"];
        assert_eq!(names, all.map(|name| format!("{name}.py")));
    }

    #[test]
    fn every_package_of_the_peers_has_a_pinned_version() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../studies/python/requirements.txt");
        let text = std::fs::read_to_string(file).unwrap();
        assert!(packages(&text).count() > 4 && packages(&text).all(|package| package.contains("==")));
        assert_eq!(packages("# a\n\n b==1 \n").collect::<Vec<_>>(), ["b==1"]);
    }

    #[test]
    fn the_packages_of_the_workflow_belong_to_the_checks_and_are_pinned() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/python/requirements.txt");
        let text = with_included(&file).unwrap();
        assert!(packages(&text).any(|package| package.starts_with("snakemake==")), "{text}");
        assert!(packages(&text).all(|package| package.contains("==") || package.starts_with('-')));
    }

    #[test]
    fn a_folder_without_checks_is_an_error() {
        assert!(scripts(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src")).is_err());
    }
}
