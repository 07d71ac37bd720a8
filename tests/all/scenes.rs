//! Helpers of the end-to-end tests: fixture scenes with overrides, real volumes, and runs in
//! temporary folders.

use std::path::{Path, PathBuf};

use cutis::report::Report;
use cutis::volume::{Volume, nifti};
use cutis::{Error, LoadedScene, Override, RunOptions, Scene, Silent};
use nalgebra::Point3;
use tempfile::TempDir;

/// The small phantom with an incision.
pub const SMALL: &str = "phantom-small.toml";

/// Folder of the example scenes.
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

/// Path of a file of the test data, such as `ct/head.nii.gz`. `None` if it is missing.
pub fn real(name: &str) -> Option<String> {
    cutis_test_kit::scans::find(name).map(|path| path.to_str().unwrap().to_owned())
}

/// A finished run and its folder, which is deleted on drop.
pub struct Run {
    pub report: Report,
    folder: TempDir,
}

impl Run {
    /// Runs a scene in a new folder.
    pub fn of(loaded: &LoadedScene) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let report = run_in(folder.path(), loaded, false).unwrap();
        Self { report, folder }
    }

    /// The bytes of a file of the run.
    pub fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.folder.path().join(name)).unwrap()
    }

    /// The deformed CT of the run.
    pub fn deformed(&self) -> Volume {
        let read = nifti::read(self.path("deformed.nii.gz")).unwrap();
        assert!(read.warnings.is_empty(), "{:?}", read.warnings);
        read.volume
    }

    /// The state in the checkpoint, without the header, which names the scene, and without the
    /// checksum.
    pub fn state(&self) -> Vec<u8> {
        let bytes = self.bytes("checkpoint.bin");
        bytes[40..bytes.len() - 32].to_vec()
    }

    /// Positions in the checkpoint, local meters.
    pub fn positions(&self) -> Vec<Point3<f32>> {
        let bytes = self.bytes("checkpoint.bin");
        let [positions, _] = state_of(&bytes);
        let values = positions.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap()));
        values.collect::<Vec<f32>>().chunks_exact(3).map(Point3::from_slice).collect()
    }

    /// Path of the run folder.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Path of a file of the run.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Sorted names of the run's files.
    pub fn names(&self) -> Vec<String> {
        names(self.folder.path())
    }
}

/// Runs a scene in a folder. With `resume` it starts from the checkpoint.
pub fn run_in(folder: &Path, loaded: &LoadedScene, resume: bool) -> Result<Report, Error> {
    cutis::run(loaded, &RunOptions { out: folder.into(), resume }, &Silent)
}

/// `frames.csv` without the wall times.
pub fn frames(folder: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(folder.join("frames.csv")).unwrap();
    let line = |line: &str| {
        let mut fields: Vec<&str> = line.split(',').collect();
        fields.remove(2);
        fields.join(",")
    };
    text.lines().map(line).collect()
}

/// A column of `frames.csv`, such as `gape_0_mean_mm`.
pub fn column(run: &Run, name: &str) -> Vec<f64> {
    let rows = frames(run.folder());
    let place = rows[0].split(',').position(|column| column == name).unwrap();
    rows[1..].iter().map(|row| row.split(',').nth(place).unwrap().parse().unwrap()).collect()
}

/// Sorted names of the files in a folder.
pub fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Positions, and velocities with all later words, in a checkpoint: the state without the history
/// of openings and forces.
pub fn state_of(checkpoint: &[u8]) -> [&[u8]; 2] {
    let count = u64::from_le_bytes(checkpoint[44..52].try_into().unwrap()) as usize;
    let (positions, rest) = checkpoint[52..checkpoint.len() - 32].split_at(12 * count);
    let number = |n: usize| u32::from_le_bytes(rest[4 * n..][..4].try_into().unwrap()) as usize;
    let [wounds, sutures, handles, rows] = [0, 1, 2, 3].map(number);
    [positions, &rest[16 + 8 * rows * (2 + 5 * wounds + 2 * sutures + handles)..]]
}
