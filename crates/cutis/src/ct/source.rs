//! The CT of a scene: read from its files, or made by the phantom.

use std::path::Path;

use cutis_volume::phantom::Phantom;
use cutis_volume::{ReadOptions, Table, TableKind, Volume};
use sha2::{Digest, Sha256};

use crate::Error;
use crate::output::report::Input;
use crate::run::files;
use crate::scene::{LoadedScene, PhantomSection, SceneFile, TableChoice};

/// The CT and its origin.
pub(crate) struct Source {
    pub(crate) volume: Volume,
    /// SHA-256 of the bytes of its files, or of the phantom's voxels. It identifies the volume.
    pub(crate) sha256: String,
    /// The scene file and the CT, for the report.
    pub(crate) inputs: Vec<Input>,
    pub(crate) warnings: Vec<String>,
}

/// Reads or makes the CT, and adds `volume.offset_hu`.
///
/// # Errors
/// [`Error::Volume`] for a file that cannot be read, [`Error`] for a phantom that cannot be made.
pub(crate) fn load(loaded: &LoadedScene) -> Result<Source, Error> {
    let source = read(loaded)?;
    Ok(Source { volume: with_offset(source.volume, loaded.scene.volume.offset_hu)?, ..source })
}

/// Adds `hu` to every value of a volume.
///
/// # Errors
/// [`Error::Volume`] if the sum with its intercept is not finite.
pub(crate) fn with_offset(volume: Volume, hu: f32) -> Result<Volume, Error> {
    if hu == 0.0 {
        return Ok(volume);
    }
    let (grid, slope, intercept) = (*volume.grid(), volume.slope(), volume.intercept());
    Ok(Volume::new(grid, volume.into_voxels(), slope, intercept + hu)?)
}

/// SHA-256 of the bytes of the files of a volume, as reports have it.
///
/// # Errors
/// [`Error::Volume`] for a file that cannot be read.
pub(crate) fn sha256_of_file(path: &Path, options: &ReadOptions) -> Result<String, Error> {
    let mut hash = Sha256::new();
    cutis_volume::read_observed(path, options, |_, bytes| hash.update(bytes))?;
    Ok(files::hex(&hash.finalize()))
}

fn read(loaded: &LoadedScene) -> Result<Source, Error> {
    let scene_input =
        Input { path: loaded.file.display().to_string(), sha256: files::sha256_of(loaded.text.as_bytes()) };
    let section = &loaded.scene.volume;
    match (&section.path, &section.phantom) {
        (Some(path), _) => {
            let mut hash = Sha256::new();
            let read = cutis_volume::read_observed(path, &section.options(), |_, bytes| hash.update(bytes))
                .map_err(loaded.file().blame("volume.path"))?;
            let sha256 = files::hex(&hash.finalize());
            let input = Input { path: path.display().to_string(), sha256: sha256.clone() };
            let inputs = vec![scene_input, input];
            Ok(Source { volume: read.volume, sha256, inputs, warnings: read.warnings })
        }
        (None, Some(PhantomSection { size, seed, turn_deg })) => {
            let volume = Phantom::new(*size, *seed)
                .and_then(|phantom| phantom.turned(*turn_deg)?.volume())
                .map_err(loaded.file().blame("volume.phantom"))?;
            let sha256 = files::sha256_of_voxels(volume.voxels());
            let mut path = format!("phantom {size:?} seed {seed}");
            if *turn_deg != [0.0; 3] {
                path += &format!(" turned by {turn_deg:?}°");
            }
            let inputs = vec![scene_input, Input { path, sha256: sha256.clone() }];
            Ok(Source { volume, sha256, inputs, warnings: Vec::new() })
        }
        (None, None) => {
            Err(loaded.file().bad_key("volume", "", "must have exactly one of `path` and `phantom`"))
        }
    }
}

impl TableChoice {
    /// The table. An error names `key`.
    pub(crate) fn table(&self, kind: TableKind, file: SceneFile<'_>, key: &str) -> Result<Table, Error> {
        let table = match self {
            Self::Preset(name) => Table::preset(kind, name),
            Self::Points(points) => {
                let points: Vec<(f32, f32)> = points.iter().map(|&[hu, value]| (hu, value)).collect();
                Table::new("scene", &points)
            }
        };
        table.map_err(|error| {
            let value = match self {
                Self::Preset(name) => format!("\"{name}\""),
                Self::Points(points) => format!("{points:?}"),
            };
            file.bad_key(key, &value, &error.to_string())
        })
    }
}
