//! Reading a scene: file, overrides, checks; and the schema and template that `cutis scene` prints.

use std::path::{Path, PathBuf};

use crate::{Error, Scene};

/// Longest scene file that is read, bytes. A scene is a page of text; anything longer is a mistake.
const MAX_SCENE_BYTES: u64 = 1 << 20;

/// One `--set key=value`.
#[derive(Clone, Debug, PartialEq)]
pub struct Override {
    /// Dotted key, for example `solver.substeps`.
    pub key: String,
    /// A TOML value; what does not parse as one is taken as a string.
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

/// A scene with the places that its relative paths and messages need.
#[derive(Clone, Debug)]
pub struct LoadedScene {
    /// The checked scene.
    pub scene: Scene,
    /// The file it came from, as messages name it.
    pub file: PathBuf,
    /// Text as read, for the report's hash.
    pub text: String,
}

impl Scene {
    /// Reads a scene file, applies `overrides` in order, resolves the volume's path and checks every value.
    ///
    /// # Errors
    /// [`Error::SceneFile`] if it cannot be read, [`Error::SceneSyntax`] if it is no TOML, [`Error::SceneKey`] for an
    /// unknown key, a wrong type or a value out of range.
    pub fn load(file: &Path, overrides: &[Override]) -> Result<LoadedScene, Error> {
        let read = |why: std::io::Error| Error::SceneFile { file: file.into(), why: why.to_string() };
        let length = std::fs::metadata(file).map_err(read)?.len();
        if length > MAX_SCENE_BYTES {
            let why = format!("it has {length} bytes; a scene has at most {MAX_SCENE_BYTES}");
            return Err(Error::SceneFile { file: file.into(), why });
        }
        let bytes = std::fs::read(file).map_err(read)?;
        let text = String::from_utf8(bytes)
            .map_err(|e| Error::SceneFile { file: file.into(), why: format!("it is not UTF-8 text: {e}") })?;
        let directory = file.parent().unwrap_or(Path::new(""));
        Self::parse(&text, file, directory, overrides)
    }

    /// As [`Scene::load`], from text. `file` is what messages name, `directory` what a relative path starts from.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn parse(
        text: &str,
        file: &Path,
        directory: &Path,
        overrides: &[Override],
    ) -> Result<LoadedScene, Error> {
        let table: toml::Table = toml::from_str(text)
            .map_err(|e| Error::SceneSyntax { file: file.into(), why: e.to_string().trim_end().into() })?;
        let mut value = toml::Value::Table(table);
        for Override { key, value: new } in overrides {
            let parts: Vec<&str> = key.split('.').collect();
            set(&mut value, &parts, parse_value(new)).map_err(|why| Error::SceneKey {
                file: file.into(),
                key: key.clone(),
                value: new.clone(),
                why,
            })?;
        }
        let mut scene: Scene = serde_path_to_error::deserialize(value.clone()).map_err(|e| {
            let key = e.path().to_string();
            let found = lookup(&value, &key).map(|v| shorten(&v.to_string())).unwrap_or_default();
            Error::SceneKey {
                file: file.into(),
                key,
                value: found,
                why: e.inner().to_string().trim().replace('\n', " "),
            }
        })?;
        scene.validate(file)?;
        let overridden = overrides.iter().any(|o| o.key == "volume.path");
        if let Some(path) = scene.volume.path.as_mut()
            && path.is_relative()
            && !overridden
        {
            *path = directory.join(&*path);
        }
        Ok(LoadedScene { scene, file: file.into(), text: text.into() })
    }
}

/// Sets the value under a dotted key, making the tables on the way. Entries of lists are addressed by number.
fn set(at: &mut toml::Value, key: &[&str], new: toml::Value) -> Result<(), String> {
    let [part, rest @ ..] = key else {
        *at = new;
        return Ok(());
    };
    match at {
        toml::Value::Table(table) => {
            set(table.entry(*part).or_insert_with(|| toml::Table::new().into()), rest, new)
        }
        toml::Value::Array(entries) => {
            let count = entries.len();
            match part.parse::<usize>().ok().and_then(|n| entries.get_mut(n)) {
                Some(entry) => set(entry, rest, new),
                None => Err(format!("`{part}` must be the number of one of the {count} entries, from 0")),
            }
        }
        other => Err(format!("`{part}` cannot be set inside the value {other}")),
    }
}

/// A TOML value; what does not parse as one is a string.
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

/// At most 80 characters of a value.
fn shorten(text: &str) -> String {
    match text.char_indices().nth(80) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.into(),
    }
}

/// JSON schema of a scene.
pub fn schema() -> serde_json::Value {
    schemars::schema_for!(Scene).to_value()
}

/// A commented scene to start from.
pub fn template() -> &'static str {
    include_str!("template.toml")
}
