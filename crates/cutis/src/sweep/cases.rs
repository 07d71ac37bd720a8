//! The cases of a study: the product of scenes, scans and axes, and the explicit ones. Each has a
//! name that depends on its own settings only.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::identity;
use super::name;
use super::study::{self, AxisSection, CaseSection, ScanSection, Setting, StudySection, bad_key};
use crate::scene::{Override, constraint_kinds};
use crate::{Error, LoadedScene};

/// Most cases of a study. A longer list is more likely a mistake than a plan.
pub const MAX_CASES: usize = 10_000;

/// One run of a study.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// Name, which is also that of the run folder. It depends on scene, scan and settings of the
    /// case, and not on other cases.
    pub name: String,
    /// The scene file.
    pub scene: PathBuf,
    /// Name of the scan, if the study lists scans.
    pub scan: Option<String>,
    /// Keys that the case sets, in order.
    pub set: Vec<Override>,
    /// Constraint kinds that the case removes.
    pub without: Vec<String>,
    /// For each axis the number of its value, if the case belongs to the product.
    pub levels: Option<Vec<usize>>,
    /// Keys that differ between cases with their values, as the study gives them or as the scene
    /// has them.
    pub settings: Vec<(String, String)>,
    /// Hash of the program's version and of the scene with all its values, without the files that
    /// it names.
    pub settings_sha256: String,
    /// Files with data that the case reads: the volume, and the strokes of the lines of tension.
    pub reads: Vec<PathBuf>,
}

/// A scene, and a scan if the study lists scans.
#[derive(Clone, Copy)]
struct Body<'a> {
    scene: &'a Path,
    scan: Option<(&'a str, &'a ScanSection)>,
}

/// All cases of a study, without what [`complete`] adds.
pub(super) fn expand(file: &Path, study: &StudySection) -> Result<Vec<Case>, Error> {
    check(file, study)?;
    let scans = scan_names(file, &study.scan)?;
    let bodies = bodies(study, &scans);
    let short = short_keys(&study.axis);
    let mut cases = Vec::new();
    if !study.axis.is_empty() || study.case.is_empty() {
        for body in &bodies {
            for levels in product(&study.axis) {
                cases.push(of_product(file, study, *body, &levels, &short));
            }
        }
    }
    for (n, section) in study.case.iter().enumerate() {
        let fits = |body: &&Body<'_>| {
            section.scene.as_deref().is_none_or(|scene| scene == body.scene)
                && section.scan.as_deref().is_none_or(|scan| body.scan.is_some_and(|(name, _)| name == scan))
        };
        let fitting: Vec<_> = bodies.iter().filter(fits).collect();
        if fitting.is_empty() {
            let why = "names a scene or a scan that the study does not list";
            return Err(bad_key(file, &format!("case[{n}]"), &section.name, why));
        }
        cases.extend(fitting.into_iter().map(|body| explicit(file, study, *body, section)));
    }
    unique(file, &cases)?;
    Ok(cases)
}

/// Refuses what is wrong with the study itself.
fn check(file: &Path, study: &StudySection) -> Result<(), Error> {
    let refuse = |key: &str, value: &str, why: &str| Err(bad_key(file, key, value, why));
    if study.scene.is_empty() {
        return refuse("scene", "[]", "must name at least one scene file");
    }
    for (n, axis) in study.axis.iter().enumerate() {
        let key = |part: &str| format!("axis[{n}].{part}");
        if axis.values.is_empty() {
            return refuse(&key("values"), "[]", "an axis must have at least one value");
        }
        if axis.key.trim().is_empty() {
            return refuse(&key("key"), &axis.key, "must be a key of the scene, such as lattice.spacing_mm");
        }
        if study.axis[..n].iter().any(|earlier| earlier.key == axis.key) {
            return refuse(&key("key"), &axis.key, "another axis has this key");
        }
    }
    let kinds: Vec<&str> = constraint_kinds().collect();
    let all = study.case.iter().enumerate().map(|(n, case)| (format!("case[{n}].without"), &case.without));
    for (key, without) in all.chain([("without".to_owned(), &study.without)]) {
        if let Some(unknown) = without.iter().find(|kind| !kinds.contains(&kind.as_str())) {
            return refuse(&key, unknown, &format!("must be among {}", kinds.join(", ")));
        }
    }
    let names = study.case.iter().enumerate().map(|(n, case)| (format!("case[{n}].name"), &case.name));
    for (key, given) in names {
        name::check(given).or_else(|why| refuse(&key, given, &why))?;
    }
    check_size(file, study)
}

/// Refuses a product that is too large, and names its factors.
fn check_size(file: &Path, study: &StudySection) -> Result<(), Error> {
    let bodies = study.scene.len().checked_mul(study.scan.len().max(1));
    let lengths = study.axis.iter().map(|axis| axis.values.len());
    let product = lengths.fold(bodies, |product, length| product?.checked_mul(length));
    let explicit = bodies.and_then(|bodies| bodies.checked_mul(study.case.len()));
    let total = product.zip(explicit).and_then(|(product, explicit)| product.checked_add(explicit));
    if total.is_some_and(|total| total <= MAX_CASES) {
        return Ok(());
    }
    let factors: Vec<String> = [(study.scene.len(), "scenes"), (study.scan.len().max(1), "scans")]
        .into_iter()
        .filter(|(count, _)| *count > 1)
        .map(|(count, what)| format!("{count} {what}"))
        .chain(study.axis.iter().map(|axis| format!("{} values of {}", axis.values.len(), axis.key)))
        .collect();
    let why = format!("{}: a study has at most {MAX_CASES} cases", factors.join(" x "));
    Err(bad_key(file, "axis", "", &why))
}

/// The name of each scan.
fn scan_names(file: &Path, scans: &[ScanSection]) -> Result<Vec<String>, Error> {
    let name = |(n, scan): (usize, &ScanSection)| {
        let key = format!("scan[{n}].name");
        let name = match (&scan.name, &scan.path) {
            (Some(name), _) => name.clone(),
            (None, Some(path)) => name::of_volume(path),
            (None, None) => return Err(bad_key(file, &key, "", "a scan without a path needs a name")),
        };
        name::check(&name).map_err(|why| bad_key(file, &key, &name, &why))?;
        Ok(name)
    };
    scans.iter().enumerate().map(name).collect()
}

/// Each scene with each scan.
fn bodies<'a>(study: &'a StudySection, names: &'a [String]) -> Vec<Body<'a>> {
    let scans: Vec<Option<(&str, &ScanSection)>> = match names {
        [] => vec![None],
        names => names.iter().map(String::as_str).zip(&study.scan).map(Some).collect(),
    };
    let of_scene = |scene: &'a PathBuf| scans.iter().map(move |&scan| Body { scene, scan });
    study.scene.iter().flat_map(of_scene).collect()
}

/// The last part of each axis's key, or the whole key if two axes have the same last part.
fn short_keys(axes: &[AxisSection]) -> Vec<String> {
    let last = |axis: &AxisSection| axis.key.rsplit('.').next().unwrap_or_default().to_owned();
    let all: Vec<String> = axes.iter().map(last).collect();
    let is_single = |short: &String| all.iter().filter(|other| *other == short).count() == 1;
    let short = all.iter().zip(axes);
    short.map(|(short, axis)| if is_single(short) { short.clone() } else { axis.key.clone() }).collect()
}

/// The numbers of the values of each axis, for each combination. The last axis changes first.
fn product(axes: &[AxisSection]) -> Vec<Vec<usize>> {
    axes.iter().fold(vec![Vec::new()], |all, axis| {
        let with = |levels: &Vec<usize>| {
            let levels = levels.clone();
            (0..axis.values.len()).map(move |n| [levels.as_slice(), &[n]].concat())
        };
        all.iter().flat_map(with).collect()
    })
}

/// A case with the keys that all cases of a body set.
fn base(file: &Path, study: &StudySection, body: Body<'_>, parts: Vec<String>) -> Case {
    let folder = file.parent().unwrap_or(Path::new(""));
    let several = |count: usize| count > 1;
    let scene = several(study.scene.len()).then(|| name::of_scene(body.scene));
    let scan = body.scan.map(|(name, _)| name.to_owned());
    let name: Vec<String> = scene.into_iter().chain(scan.clone()).chain(parts).collect();
    let mut set: Vec<Override> = settings(&study.set);
    if let Some((_, section)) = body.scan {
        set.extend(section.path.as_ref().map(|path| Override {
            key: "volume.path".into(),
            value: toml::Value::String(path.to_string_lossy().into_owned()).to_string(),
        }));
        set.extend(settings(&section.set));
    }
    Case {
        name: name::joined(&name, body.scene),
        scene: folder.join(body.scene),
        scan,
        set,
        without: study.without.clone(),
        levels: None,
        settings: Vec::new(),
        settings_sha256: String::new(),
        reads: Vec::new(),
    }
}

fn of_product(file: &Path, study: &StudySection, body: Body<'_>, levels: &[usize], short: &[String]) -> Case {
    let values = || study.axis.iter().zip(levels).map(|(axis, &n)| axis.values[n].to_string());
    let parts = short.iter().zip(values()).map(|(key, value)| name::of_setting(key, &value));
    let mut case = base(file, study, body, parts.collect());
    let keys = study.axis.iter().map(|axis| axis.key.clone());
    case.set.extend(keys.zip(values()).map(|(key, value)| Override { key, value }));
    case.levels = Some(levels.to_vec());
    case
}

fn explicit(file: &Path, study: &StudySection, body: Body<'_>, section: &CaseSection) -> Case {
    let mut case = base(file, study, body, vec![section.name.clone()]);
    case.set.extend(settings(&section.set));
    case.without.extend_from_slice(&section.without);
    case
}

fn settings(list: &[Setting]) -> Vec<Override> {
    list.iter().map(|Setting(setting)| setting.clone()).collect()
}

/// Refuses two cases with one name, also if they differ only in capital letters.
fn unique(file: &Path, cases: &[Case]) -> Result<(), Error> {
    let mut seen = HashMap::new();
    for case in cases {
        if let Some(other) = seen.insert(case.name.to_lowercase(), &case.name) {
            let why = format!(
                "another case has the name `{other}`: give scenes, scans and cases different names, and axes \
                 different values"
            );
            return Err(bad_key(file, "case", &case.name, &why));
        }
    }
    Ok(())
}

/// The keys that differ between cases: those of the axes, then those of explicit cases.
pub(super) fn varied_keys(study: &StudySection) -> Vec<String> {
    let of_axes = study.axis.iter().map(|axis| axis.key.clone());
    let of_cases = study.case.iter().flat_map(|case| &case.set).map(|Setting(setting)| setting.key.clone());
    let mut keys = Vec::new();
    of_axes.chain(of_cases).for_each(|key| {
        if !keys.contains(&key) {
            keys.push(key);
        }
    });
    keys
}

/// Checks the scene of a case and adds what follows from it.
pub(super) fn complete(file: &Path, case: &mut Case, varied: &[String]) -> Result<(), Error> {
    make_paths_relative_to(file.parent().unwrap_or(Path::new("")), &mut case.set);
    let LoadedScene { scene, .. } = study::load(file, case)?;
    let values = serde_json::to_value(&scene).unwrap_or_default();
    let value = |key: &String| {
        let given = case.set.iter().rev().find(|setting| setting.key == *key);
        let text = given.map(|given| given.value.clone()).or_else(|| looked_up(&values, key));
        (key.clone(), name::plain(&text.unwrap_or_default()))
    };
    case.settings = varied.iter().map(value).collect();
    case.settings_sha256 = identity::settings_sha256(&scene);
    case.reads = identity::reads(&scene).into_iter().cloned().collect();
    Ok(())
}

/// Paths that a study gives start from its folder.
fn make_paths_relative_to(folder: &Path, set: &mut [Override]) {
    let is_path = |key: &str| {
        ["volume.path", "constraints.membrane.directions.strokes"].contains(&key) || key.ends_with(".markups")
    };
    for setting in set.iter_mut().filter(|setting| is_path(&setting.key)) {
        let text = toml::from_str::<toml::Table>(&format!("path = {}", setting.value)).ok();
        let text = text.and_then(|table| Some(table.get("path")?.as_str()?.to_owned()));
        let path = folder.join(text.as_deref().unwrap_or(&setting.value));
        setting.value = toml::Value::String(path.to_string_lossy().into_owned()).to_string();
    }
}

/// The value at a dotted key.
fn looked_up(values: &Value, key: &str) -> Option<String> {
    let key = key.replace('[', ".").replace(']', "");
    let found = key.split('.').try_fold(values, |at, part| match at {
        Value::Array(list) => list.get(part.parse::<usize>().ok()?),
        other => other.get(part),
    })?;
    (!found.is_null()).then(|| found.to_string())
}
