//! What identifies a case: its settings, and the bytes of the files that it reads.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use crate::ct::source;
use crate::run::files;
use crate::{Error, LoadedScene, Scene};

/// Hash of the program's version and of all values of a scene. The number of threads is no part of
/// it, because no result depends on it, and neither are the places of files.
pub(super) fn settings_sha256(scene: &Scene) -> String {
    let mut scene = scene.clone();
    scene.solver.threads = 0;
    scene.volume.path = None;
    if let Some(strokes) = strokes_of(&mut scene) {
        *strokes = None;
    }
    let text = serde_json::to_string(&scene).unwrap_or_default();
    files::sha256_of(format!("{}\n{text}", env!("CARGO_PKG_VERSION")).as_bytes())
}

fn strokes_of(scene: &mut Scene) -> Option<&mut Option<PathBuf>> {
    Some(&mut scene.constraints.membrane.as_mut()?.directions.as_mut()?.strokes)
}

/// Files with data that a scene reads: the volume, and the strokes of the lines of tension.
pub(super) fn reads(scene: &Scene) -> Vec<&PathBuf> {
    let strokes =
        scene.constraints.membrane.as_ref().and_then(|skin| skin.directions.as_ref()?.strokes.as_ref());
    scene.volume.path.iter().chain(strokes).collect()
}

/// Hashes of the files of many cases. Each file is read once.
#[derive(Default)]
pub struct Hashes {
    known: HashMap<String, Result<String, String>>,
}

impl Hashes {
    /// The hashes of the files that a scene reads, in the order of [`reads`]: that of a volume is
    /// the one in reports.
    ///
    /// # Errors
    /// The reason why a file cannot be read.
    pub(super) fn of(&mut self, loaded: &LoadedScene) -> Result<Vec<String>, String> {
        let volume = &loaded.scene.volume;
        let key = |path: &PathBuf| match volume.path.as_ref() == Some(path) {
            true => format!("{} {:?} {}", path.display(), volume.series, volume.resample),
            false => path.display().to_string(),
        };
        let hash = |path: &PathBuf| match volume.path.as_ref() == Some(path) {
            true => source::sha256_of_file(path, &volume.options()).map_err(|e| e.to_string()),
            false => sha256_of_file(path).map_err(|e| e.to_string()),
        };
        let all = reads(&loaded.scene).into_iter();
        all.map(|path| self.known.entry(key(path)).or_insert_with(|| hash(path)).clone()).collect()
    }
}

/// Hashes of the files that a run has read, without reading its volume again.
pub(super) fn after_run(scene: &Scene, volume_sha256: Option<&str>) -> Result<Vec<String>, Error> {
    let hash = |path: &PathBuf| match volume_sha256 {
        Some(sha256) if scene.volume.path.as_ref() == Some(path) => Ok(sha256.to_owned()),
        _ => sha256_of_file(path),
    };
    reads(scene).into_iter().map(hash).collect()
}

/// SHA-256 of the bytes of a file, in hexadecimal digits.
fn sha256_of_file(path: &Path) -> Result<String, Error> {
    Ok(files::sha256_of(&files::read(path)?))
}
