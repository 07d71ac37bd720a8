//! The study file: which scenes, scans and settings a sweep runs.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer};

use super::cases::{self, Case};
use crate::scene::nearest;
use crate::scene::{OneOr, Override};
use crate::{Error, Scene};

/// Longest study file that is read, bytes.
const MAX_STUDY_BYTES: u64 = 1 << 20;

/// A checked study: every case has a valid scene.
#[derive(Clone, Debug)]
pub struct Study {
    /// The study file, as messages name it.
    pub file: PathBuf,
    /// The cases in order: the product of scenes, scans and axes, then the explicit cases.
    pub cases: Vec<Case>,
    /// The axes that the product has.
    pub axes: Vec<Axis>,
}

/// Values of one key that the study runs through.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Dotted key of the scene.
    pub key: String,
    /// The values as TOML, in order.
    pub values: Vec<String>,
}

/// The file as it is written.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct StudySection {
    /// The scene file, or a list of scene files. Relative to the study file.
    #[serde(deserialize_with = "paths")]
    #[schemars(with = "Vec<PathBuf>")]
    pub(super) scene: Vec<PathBuf>,
    /// Keys that all cases set, each as `key=value`.
    #[serde(default)]
    pub(super) set: Vec<Setting>,
    /// Constraint kinds that all cases remove.
    #[serde(default)]
    pub(super) without: Vec<String>,
    /// The scans. Left out: those that the scenes name.
    #[serde(default)]
    pub(super) scan: Vec<ScanSection>,
    /// The axes of the product.
    #[serde(default)]
    pub(super) axis: Vec<AxisSection>,
    /// Cases in addition to the product.
    #[serde(default)]
    pub(super) case: Vec<CaseSection>,
}

/// A scan, and what a scene needs to know about it.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ScanSection {
    /// Name in the names of cases. Left out: the name of the file without its ending.
    pub(super) name: Option<String>,
    /// The volume, in place of the scene's `volume.path`. Relative to the study file.
    pub(super) path: Option<PathBuf>,
    /// Keys that belong to this scan, each as `key=value`: for example the place of the incision.
    #[serde(default)]
    pub(super) set: Vec<Setting>,
}

/// An axis of the product.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct AxisSection {
    /// Dotted key of the scene, as in `--set`.
    pub(super) key: String,
    /// Its values.
    #[schemars(with = "Vec<serde_json::Value>")]
    pub(super) values: Vec<toml::Value>,
}

/// A case in addition to the product. It runs with every scene and scan that it does not restrict.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct CaseSection {
    /// Name of the case.
    pub(super) name: String,
    /// One of the scenes. Left out: each.
    pub(super) scene: Option<PathBuf>,
    /// Name of one of the scans. Left out: each.
    pub(super) scan: Option<String>,
    /// Keys that the case sets, each as `key=value`.
    #[serde(default)]
    pub(super) set: Vec<Setting>,
    /// Constraint kinds that the case removes.
    #[serde(default)]
    pub(super) without: Vec<String>,
}

/// A key with its value, written as on the command line.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(try_from = "String")]
#[schemars(with = "String")]
pub(super) struct Setting(pub(super) Override);

impl TryFrom<String> for Setting {
    type Error = String;
    fn try_from(text: String) -> Result<Self, String> {
        text.parse().map(Self)
    }
}

fn paths<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<PathBuf>, D::Error> {
    Ok(match OneOr::<PathBuf, Vec<PathBuf>>::deserialize(deserializer)? {
        OneOr::One(path) => vec![path],
        OneOr::List(paths) => paths,
    })
}

impl Study {
    /// Reads a study file and checks the scene of every case. It reads no scan.
    ///
    /// # Errors
    /// [`Error::StudyFile`] if the file cannot be read, [`Error::StudyKey`] for a key or value of
    /// the study that cannot be used, [`Error::StudyCase`] for a case whose scene is not valid.
    pub fn load(file: &Path) -> Result<Self, Error> {
        let section = StudySection::read(file)?;
        let mut cases = cases::expand(file, &section)?;
        let varied = cases::varied_keys(&section);
        cases.iter_mut().try_for_each(|case| cases::complete(file, case, &varied))?;
        let axes = section.axis.iter().map(|axis| Axis {
            key: axis.key.clone(),
            values: axis.values.iter().map(ToString::to_string).collect(),
        });
        Ok(Self { file: file.into(), cases, axes: axes.collect() })
    }

    /// Reads a study file and checks the scene of one case only.
    ///
    /// # Errors
    /// The errors of [`Study::load`], and [`Error::Request`] if there is no such case. It names the
    /// nearest one.
    pub fn load_case(file: &Path, name: &str) -> Result<Case, Error> {
        let section = StudySection::read(file)?;
        let cases = cases::expand(file, &section)?;
        let mut case = cases.iter().find(|case| case.name == name).cloned().ok_or_else(|| {
            let names = cases.iter().map(|case| case.name.as_str());
            let nearest = nearest::of(name, names).map(|near| format!("; the nearest one is `{near}`"));
            Error::Request {
                what: format!("{}: case `{name}`", file.display()),
                why: format!("the study has no such case{}", nearest.unwrap_or_default()),
            }
        })?;
        cases::complete(file, &mut case, &cases::varied_keys(&section))?;
        Ok(case)
    }

    /// JSON schema of a study file.
    pub fn json_schema() -> serde_json::Value {
        schemars::schema_for!(StudySection).to_value()
    }
}

impl StudySection {
    fn read(file: &Path) -> Result<Self, Error> {
        let text = read(file).map_err(|why| Error::StudyFile { file: file.into(), why })?;
        let value: toml::Value = toml::from_str(&text)
            .map(toml::Value::Table)
            .map_err(|e| Error::StudyFile { file: file.into(), why: format!("not valid TOML: {e}") })?;
        serde_path_to_error::deserialize(value).map_err(|e| {
            let why = nearest::plain(&nearest::with_suggestion(e.inner().to_string().trim()));
            bad_key(file, &e.path().to_string(), "", &why)
        })
    }
}

/// The error for a key of the study whose value cannot be used.
pub(super) fn bad_key(file: &Path, key: &str, value: &str, why: &str) -> Error {
    Error::StudyKey { file: file.into(), key: key.into(), value: value.into(), why: why.into() }
}

fn read(file: &Path) -> Result<String, String> {
    let mut bytes = Vec::new();
    File::open(file)
        .and_then(|f| f.take(MAX_STUDY_BYTES + 1).read_to_end(&mut bytes))
        .map_err(|e| e.to_string())?;
    if bytes.len() as u64 > MAX_STUDY_BYTES {
        return Err(format!("it is longer than the {MAX_STUDY_BYTES} bytes that a study may have"));
    }
    String::from_utf8(bytes).map_err(|e| format!("it is not UTF-8 text: {e}"))
}

/// Loads the scene of a case.
///
/// # Errors
/// [`Error::StudyCase`] around the errors of [`Scene::load`], or for a scene without a report.
pub(super) fn load(study: &Path, case: &Case) -> Result<crate::LoadedScene, Error> {
    let of_case = |source: Error| Error::StudyCase {
        file: study.into(),
        case: case.name.clone(),
        source: Box::new(source),
    };
    let mut loaded = Scene::load(&case.scene, &case.set).map_err(of_case)?;
    for kind in &case.without {
        loaded.scene.constraints.remove(kind);
    }
    if !loaded.scene.output.report {
        let why = "must be true: a sweep reads the results of a case from its report. In the study, \
                   set = [\"output={ report = true }\"] writes the report alone";
        return Err(of_case(loaded.file().bad_key("output.report", "false", why)));
    }
    Ok(loaded)
}
