//! The CT of a scene: read from its file, or made by the phantom.

use std::path::Path;

use cutis_volume::phantom::Phantom;
use cutis_volume::sample::LatticeSize;
use cutis_volume::{Table, TableKind, Volume, nifti};

use crate::Error;
use crate::report::Input;
use crate::run::files;
use crate::scene::{LatticeSection, LoadedScene, PhantomSection, SplitChoice, TableChoice, VolumeSection};

/// The CT and where it came from.
pub(crate) struct Source {
    pub(crate) volume: Volume,
    /// Identifies the volume: hash of the file, or of the phantom's voxels.
    pub(crate) sha256: String,
    pub(crate) inputs: Vec<Input>,
    pub(crate) warnings: Vec<String>,
}

/// Reads or makes the CT.
pub(crate) fn load(loaded: &LoadedScene) -> Result<Source, Error> {
    let scene_input =
        Input { path: loaded.file.display().to_string(), sha256: files::sha256_of(loaded.text.as_bytes()) };
    match &loaded.scene.volume {
        VolumeSection { path: Some(path), .. } => {
            let read = nifti::read(path)?;
            let sha256 = files::sha256(path)?;
            let input = Input { path: path.display().to_string(), sha256: sha256.clone() };
            Ok(Source {
                volume: read.volume,
                sha256,
                inputs: vec![scene_input, input],
                warnings: read.warnings,
            })
        }
        VolumeSection { phantom: Some(PhantomSection { size, seed }), path: None } => {
            let volume = Phantom::new(*size, *seed)
                .and_then(|p| p.volume())
                .map_err(loaded.blame("volume.phantom"))?;
            let sha256 = files::sha256_of_voxels(volume.voxels());
            let path = format!("phantom {size:?} seed {seed}");
            let inputs = vec![scene_input, Input { path, sha256: sha256.clone() }];
            Ok(Source { volume, sha256, inputs, warnings: Vec::new() })
        }
        VolumeSection { path: None, phantom: None } => Err(missing_volume(&loaded.file)),
    }
}

fn missing_volume(file: &Path) -> Error {
    let why = "must have exactly one of `path` and `phantom`".into();
    Error::SceneKey { file: file.into(), key: "volume".into(), value: String::new(), why }
}

impl LatticeSection {
    /// In the terms of `cutis-volume`.
    pub(crate) fn size(&self) -> LatticeSize {
        match (self.vertices, self.spacing_mm) {
            (Some(vertices), _) => LatticeSize::Vertices(vertices),
            (None, Some(spacing)) => LatticeSize::SpacingMm(spacing),
            (None, None) => LatticeSize::Native,
        }
    }
}

impl From<SplitChoice> for cutis_mesh::Split {
    fn from(choice: SplitChoice) -> Self {
        match choice {
            SplitChoice::Kuhn6 => Self::Kuhn6,
            SplitChoice::Five => Self::Five,
        }
    }
}

impl TableChoice {
    /// The table that is meant; `key` is what an error names.
    pub(crate) fn table(&self, kind: TableKind, file: &Path, key: &str) -> Result<Table, Error> {
        let table = match self {
            Self::Preset(name) => Table::preset(kind, name),
            Self::Points(points) => {
                let points: Vec<(f32, f32)> = points.iter().map(|&[hu, value]| (hu, value)).collect();
                Table::new("scene", &points)
            }
        };
        table.map_err(|e| {
            let value = match self {
                Self::Preset(name) => format!("\"{name}\""),
                Self::Points(points) => format!("{points:?}"),
            };
            Error::SceneKey { file: file.into(), key: key.into(), value, why: e.to_string() }
        })
    }
}
