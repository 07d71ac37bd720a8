//! What the end-to-end tests share: fixture scenes with overrides, the real volumes, a run in a folder of its own.

use std::path::{Path, PathBuf};

use cutis::report::Report;
use cutis::{Error, LoadedScene, Override, RunOptions, Scene, Silent};
use tempfile::TempDir;

/// The small phantom with an incision.
pub const SMALL: &str = "phantom-small.toml";

/// Folder of the scenes that tests, benches and users share.
pub fn folder() -> PathBuf {
    concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/scenes").into()
}

/// Overrides as `--set` gives them.
pub fn overrides(set: &[(&str, &str)]) -> Vec<Override> {
    set.iter().map(|&(key, value)| Override { key: key.into(), value: value.into() }).collect()
}

/// A fixture scene with overrides.
pub fn scene(name: &str, set: &[(&str, &str)]) -> LoadedScene {
    Scene::load(&folder().join(name), &overrides(set)).unwrap()
}

/// A real volume, or `None` with a printed reason; in CI its absence is a failure.
pub fn real(name: &str) -> Option<String> {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data");
    let data = PathBuf::from(std::env::var_os("CUTIS_TEST_DATA").unwrap_or_else(|| beside.into()));
    let path = data.join("ct").join(name);
    if path.is_file() {
        return Some(path.to_str().unwrap().to_owned());
    }
    assert!(std::env::var_os("CI").is_none(), "there is no {}", path.display());
    eprintln!("skipped: there is no {} (set CUTIS_TEST_DATA)", path.display());
    None
}

/// A finished run and its folder, which goes when this is dropped.
pub struct Run {
    pub report: Report,
    folder: TempDir,
}

impl Run {
    /// Runs a scene in a fresh folder.
    pub fn of(loaded: &LoadedScene) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let report = run_in(folder.path(), loaded, false).unwrap();
        Self { report, folder }
    }

    /// The bytes of one of its files.
    pub fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.folder.path().join(name)).unwrap()
    }

    /// Path of one of its files.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Names of its files, sorted.
    pub fn names(&self) -> Vec<String> {
        names(self.folder.path())
    }
}

/// Runs a scene in a folder, from its checkpoint if `resume`.
pub fn run_in(folder: &Path, loaded: &LoadedScene, resume: bool) -> Result<Report, Error> {
    cutis::run(loaded, &RunOptions { out: folder.into(), resume }, &Silent)
}

/// Names of the files in a folder, sorted.
pub fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}
