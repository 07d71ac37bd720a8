//! Reading a scene: file, overrides and checks. Also the schema and the template that `cutis scene`
//! prints.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use super::SolverSection;
use super::nearest;
use super::steps::{self, Steps};
use crate::{Error, Scene};

/// Longest scene file that is read, bytes. A scene is a page of text, so a longer file is a
/// mistake.
const MAX_SCENE_BYTES: u64 = 1 << 20;
/// Most parts of an override's dotted key. The deepest key of a scene has four parts.
const MAX_KEY_PARTS: usize = 16;

/// Longest reason that a message quotes, characters. It may hold a name from the file, and the list
/// of the names that are valid.
const MAX_REASON: usize = 2000;

/// One `--set key=value`.
#[derive(Clone, Debug, PartialEq)]
pub struct Override {
    /// Dotted key, for example `solver.substeps`.
    pub key: String,
    /// A TOML value. Text that is not a TOML value is taken as a string.
    pub value: String,
}

impl std::str::FromStr for Override {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once('=') {
            Some((key, value)) if !key.trim().is_empty() => {
                Ok(Self { key: key.trim().into(), value: value.trim().into() })
            }
            _ => Err(format!("`{text}` is not of the form key=value, for example solver.substeps=20")),
        }
    }
}

/// A checked scene, with the file that it came from.
#[derive(Clone, Debug)]
pub struct LoadedScene {
    /// The checked scene.
    pub scene: Scene,
    /// The file it came from, as messages name it.
    pub file: PathBuf,
    /// Text as read, for the report's hash.
    pub text: String,
    /// Where the steps of the scene went.
    pub(crate) steps: Steps,
    /// What was skipped in the files that the scene names.
    pub(crate) notes: Vec<String>,
}

impl LoadedScene {
    /// The file, for errors about the scene.
    pub(crate) fn file(&self) -> SceneFile<'_> {
        SceneFile { file: &self.file, steps: &self.steps }
    }
}

/// The file of a scene, which errors about the scene name.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SceneFile<'a> {
    pub(crate) file: &'a Path,
    pub(crate) steps: &'a Steps,
}

impl SceneFile<'_> {
    /// Turns an error into one that names the section of the scene that caused it. An error that
    /// already names a key stays unchanged.
    pub(crate) fn blame<E: Into<Error>>(self, section: &str) -> impl FnOnce(E) -> Error {
        move |error| match error.into() {
            named @ Error::SceneKey { .. } => named,
            source => {
                let section = self.steps.name(section);
                Error::SceneSection { file: self.file.into(), section, source: Box::new(source) }
            }
        }
    }

    /// The error for a key whose value cannot be used. `value` is the value found, or empty if
    /// there is none to show. `why` describes the valid values.
    pub(crate) fn bad_key(self, key: &str, value: &str, why: &str) -> Error {
        let key = self.steps.name(key);
        Error::SceneKey { file: self.file.into(), key, value: value.into(), why: why.into() }
    }
}

impl Scene {
    /// Reads a scene file, applies `overrides` in order, resolves the paths of other files, reads
    /// the paths of cuts from them and checks every value.
    ///
    /// # Errors
    /// [`Error::SceneFile`] if the file cannot be read, [`Error::SceneSyntax`] if it is not TOML,
    /// [`Error::SceneKey`] for an unknown key, a wrong type or a value out of range,
    /// [`Error::SceneSection`] for the path of a cut that cannot be read from its file.
    pub fn load(file: &Path, overrides: &[Override]) -> Result<LoadedScene, Error> {
        let read = |why: std::io::Error| Error::SceneFile { file: file.into(), why: why.to_string() };
        let mut bytes = Vec::new();
        File::open(file).and_then(|f| f.take(MAX_SCENE_BYTES + 1).read_to_end(&mut bytes)).map_err(read)?;
        if bytes.len() as u64 > MAX_SCENE_BYTES {
            let why = format!("it is longer than the {MAX_SCENE_BYTES} bytes that a scene may have");
            return Err(Error::SceneFile { file: file.into(), why });
        }
        let text = String::from_utf8(bytes)
            .map_err(|e| Error::SceneFile { file: file.into(), why: format!("it is not UTF-8 text: {e}") })?;
        let directory = file.parent().unwrap_or(Path::new(""));
        Self::parse(&text, file, directory, overrides)
    }

    /// Does the same as [`Scene::load`] with a scene given as text. Messages name `file`; a
    /// relative path of the volume starts from `directory`.
    ///
    /// # Errors
    /// The errors of [`Scene::load`].
    pub fn parse(
        text: &str,
        file: &Path,
        directory: &Path,
        overrides: &[Override],
    ) -> Result<LoadedScene, Error> {
        Self::parse_with(text, file, directory, overrides).map_err(|error| name_override(error, overrides))
    }

    fn parse_with(
        text: &str,
        file: &Path,
        directory: &Path,
        overrides: &[Override],
    ) -> Result<LoadedScene, Error> {
        let table: toml::Table = toml::from_str(text).map_err(|e| {
            // The message quotes the line, which may be the whole file if the file is not a scene.
            let lines: Vec<String> = e.to_string().trim_end().lines().map(shorten).collect();
            Error::SceneSyntax { file: file.into(), why: lines.join("\n") }
        })?;
        let mut value = toml::Value::Table(table);
        for Override { key, value: new } in overrides {
            // A scene without the section has default outputs, and an override changes one of them.
            if key.starts_with("output.") && value.get("output").is_none() {
                let defaults = toml::Value::try_from(super::OutputSection::default());
                if let (toml::Value::Table(table), Ok(defaults)) = (&mut value, defaults) {
                    table.insert("output".into(), defaults);
                }
            }
            set(&mut value, key, parse_value(new)).map_err(|why| Error::SceneKey {
                file: file.into(),
                key: shorten(key),
                value: shorten(new),
                why,
            })?;
        }
        let steps = Steps::take(&mut value).map_err(|(key, value, why)| Error::SceneKey {
            file: file.into(),
            key,
            value: shorten(&value),
            why,
        })?;
        let named = |key: &str| lookup(&value, key).is_some();
        let [substeps_named, iterations_named] = ["solver.substeps", "solver.iterations"].map(named);
        let mut scene: Scene = serde_path_to_error::deserialize(value.clone()).map_err(|e| {
            let (key, message) = (e.path().to_string(), e.inner().to_string().trim().replace('\n', " "));
            let file = file.into();
            if let Some(missing) = missing_key(&key, &message) {
                let (value, why) = (String::new(), "is missing".into());
                return Error::SceneKey { file, key: shorten(&steps.name(&missing)), value, why };
            }
            let found = lookup(&value, &key).map(|v| shorten(&v.to_string())).unwrap_or_default();
            // Steps are read before the rest of the scene.
            let message = match key.contains('.') {
                true => message,
                false => message.replace("expected one of `model`", "expected one of `step`, `model`"),
            };
            let why = nearest::plain(&nearest::with_suggestion(&first_chars(&message, MAX_REASON)));
            Error::SceneKey { file, key: shorten(&steps.name(&key)), value: found, why }
        })?;
        let (substeps, iterations) = SolverSection::steps_of(scene.solver.formulation);
        if !substeps_named {
            scene.solver.substeps = substeps;
        }
        if !iterations_named {
            scene.solver.iterations = iterations;
        }
        crate::model::fill_defaults(&mut scene);
        super::pick_region::fill(&mut scene);
        let of_scene = SceneFile { file, steps: &steps };
        let notes = super::markups::fill(&mut scene, of_scene, directory, overrides)?;
        scene.validate(of_scene)?;
        // Paths in a scene start from its folder, and paths in an override from the present one.
        let strokes =
            scene.constraints.membrane.as_mut().and_then(|skin| skin.directions.as_mut()?.strokes.as_mut());
        for (key, path) in [
            ("volume.path", scene.volume.path.as_mut()),
            ("constraints.membrane.directions.strokes", strokes),
        ] {
            let overridden = overrides.iter().any(|o| o.key == key);
            if let Some(path) = path.filter(|path| path.is_relative() && !overridden) {
                *path = directory.join(&*path);
            }
        }
        Ok(LoadedScene { scene, file: file.into(), text: text.into(), steps, notes })
    }
}

/// Says that the value of a key comes from an override and does not stand in the file.
fn name_override(error: Error, overrides: &[Override]) -> Error {
    let dots = |key: &str| key.replace('[', ".").replace(']', "");
    match error {
        Error::SceneKey { file, key, value, why } => {
            let own = dots(&key);
            let of = |o: &Override| own == dots(&o.key) || own.starts_with(&format!("{}.", dots(&o.key)));
            let file = match overrides.iter().any(of) {
                true => format!("{}, overridden", file.display()).into(),
                false => file,
            };
            Error::SceneKey { file, key, value, why }
        }
        other => other,
    }
}

/// The key that a message of serde about the section `at` misses.
fn missing_key(at: &str, message: &str) -> Option<String> {
    let missing = message.strip_prefix("missing field `")?.split('`').next()?;
    Some(if at == "." { missing.to_owned() } else { format!("{at}.{missing}") })
}

/// Sets the value of a dotted key and creates missing tables. Entries of lists are addressed by
/// number.
fn set(mut at: &mut toml::Value, key: &str, new: toml::Value) -> Result<(), String> {
    // A key may have the form of messages (`incision[0].depth_mm`), or dots alone.
    let key = &key.replace('[', ".").replace(']', "");
    let parts = key.split('.').count();
    if parts > MAX_KEY_PARTS {
        return Err(format!("has {parts} parts; a key of a scene has at most {MAX_KEY_PARTS}"));
    }
    if key.split('.').any(str::is_empty) {
        return Err("has an empty name: write names with one dot between them, as in solver.substeps".into());
    }
    for part in key.split('.') {
        at = match at {
            toml::Value::Table(table) => table.entry(part).or_insert_with(|| toml::Table::new().into()),
            toml::Value::Array(entries) => {
                let count = entries.len();
                part.parse::<usize>().ok().and_then(|n| entries.get_mut(n)).ok_or_else(|| {
                    format!("`{}` must be the number of one of the {count} entries, from 0", shorten(part))
                })?
            }
            other => {
                return Err(format!(
                    "`{}` cannot be set inside the value {}",
                    shorten(part),
                    shorten(&other.to_string())
                ));
            }
        };
    }
    *at = new;
    Ok(())
}

/// A TOML value. Text that is not a TOML value is a string.
fn parse_value(text: &str) -> toml::Value {
    toml::from_str::<toml::Table>(&format!("value = {text}"))
        .ok()
        .filter(|table| table.len() == 1)
        .and_then(|mut table| table.remove("value"))
        .unwrap_or_else(|| toml::Value::String(text.into()))
}

/// The value at the path that serde reports (`incision[0].depth_mm`), if there is one.
fn lookup<'a>(value: &'a toml::Value, path: &str) -> Option<&'a toml::Value> {
    path.split(['.', '[']).try_fold(value, |at, part| match part.strip_suffix(']') {
        Some(index) => at.as_array()?.get(index.parse::<usize>().ok()?),
        None => at.get(part),
    })
}

/// The first 120 characters of a text.
fn shorten(text: &str) -> String {
    first_chars(text, 120)
}

fn first_chars(text: &str, most: usize) -> String {
    match text.char_indices().nth(most) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.into(),
    }
}

/// JSON schema of a scene.
pub fn schema() -> serde_json::Value {
    let mut schema = schemars::schema_for!(Scene).to_value();
    steps::add_to_schema(&mut schema);
    schema
}

/// A commented scene to start from.
pub fn template() -> &'static str {
    include_str!("template.toml")
}
