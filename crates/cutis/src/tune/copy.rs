//! Writes a copy of a scene file with changed values. Comments and the order of keys are kept.

use std::path::{Path, PathBuf};

use cutis_volume::PartialFile;
use toml_edit::{Array, DocumentMut, InlineTable, Item, TableLike, Value};

use crate::Error;
use crate::run::files;
use crate::scene::{LoadedScene, RegionSection, Scene};

/// Destination of the copy, checked before the long work starts.
pub(super) struct SceneCopy<'a> {
    loaded: &'a LoadedScene,
    path: &'a Path,
}

impl<'a> SceneCopy<'a> {
    /// Checks the destination. It refuses an existing file (unless `overwrite`), the scene's own
    /// file, a path that cannot be written, and a scene that cannot be edited.
    pub(super) fn to(path: &'a Path, overwrite: bool, loaded: &'a LoadedScene) -> Result<Self, Error> {
        let refuse = |why: &str| Error::Request { what: format!("{}", path.display()), why: why.into() };
        let same =
            |a: &Path, b: &Path| matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b);
        if same(path, &loaded.file) {
            return Err(refuse("is the scene itself, which is never changed; name another file"));
        }
        if path.exists() && !overwrite {
            return Err(refuse("exists; --force overwrites it, -o names another file"));
        }
        if path.is_dir() {
            return Err(refuse("is a folder; give a file name with -o"));
        }
        // The trial file is removed at once.
        PartialFile::create(path)
            .map(drop)
            .map_err(|error| refuse(&format!("cannot be written: {error}")))?;
        let copy = Self { loaded, path };
        copy.text(&loaded.scene)?;
        Ok(copy)
    }

    /// Writes lines of comment, then the scene's text, edited so that it describes `scene`.
    ///
    /// # Errors
    /// [`Error::File`] if the file cannot be written.
    pub(super) fn write(&self, scene: &Scene, comment: &[String]) -> Result<(), Error> {
        let comment: String = comment.iter().map(|line| format!("# {line}\n")).collect();
        files::write(self.path, (comment + &self.text(scene)?).as_bytes())
    }

    fn text(&self, scene: &Scene) -> Result<String, Error> {
        let directory = self.path.parent().unwrap_or(Path::new(""));
        edited(self.loaded, scene, directory)
            .map_err(|why| Error::Request { what: format!("{}", self.path.display()), why })
    }
}

/// The text of a scene file that describes `wanted` when it is read from `directory`.
fn edited(loaded: &LoadedScene, wanted: &Scene, directory: &Path) -> Result<String, String> {
    let plain = |e: &dyn std::fmt::Display| e.to_string();
    let value = |scene: &Scene| toml::Table::try_from(comparable(scene)).map_err(|e| plain(&e));
    let mut document: DocumentMut = loaded.text.parse().map_err(|e| plain(&e))?;
    let home = loaded.file.parent().unwrap_or(Path::new(""));
    let mut anywhere = document.clone();
    make_markups_absolute(&mut anywhere, home)?;
    let written = Scene::parse(&anywhere.to_string(), &loaded.file, Path::new(""), &[]);
    let written = written.map_err(|e| plain(&e))?.scene;
    if absolute(home) != absolute(directory) {
        make_markups_absolute(&mut document, home)?;
    }
    let mut from = value(&written)?;
    if written.solver.formulation != wanted.solver.formulation {
        // The defaults of these keys depend on the formulation, so they are written.
        let solver = from.get_mut("solver").and_then(toml::Value::as_table_mut);
        solver
            .into_iter()
            .for_each(|solver| solver.retain(|key, _| key != "substeps" && key != "iterations"));
    }
    change(document.as_table_mut(), &from, &value(wanted)?);

    let read = |document: &DocumentMut| Scene::parse(&document.to_string(), &loaded.file, directory, &[]);
    let path = |scene: &Scene| scene.volume.path.as_deref().map(absolute);
    if let Some(path) =
        path(wanted).filter(|p| read(&document).ok().and_then(|read| path(&read.scene)).as_ref() != Some(p))
    {
        let text = path.to_str().ok_or("the path of the volume is not Unicode")?;
        document["volume"]["path"] = toml_edit::value(text);
    }
    let found = read(&document).map_err(|e| plain(&e))?.scene;
    if comparable(&found) != comparable(wanted) || path(&found) != path(wanted) {
        return Err("the edited scene has other values than intended; this is a bug in cutis".into());
    }
    Ok(document.to_string())
}

/// Makes the names of files with the paths of cuts absolute. `home` is the folder of the scene.
fn make_markups_absolute(document: &mut DocumentMut, home: &Path) -> Result<(), String> {
    for list in ["incision", "excision", "suture", "handle", "step"] {
        let Some(entries) = document.get_mut(list) else { continue };
        let tables: Vec<&mut dyn TableLike> = match entries {
            Item::ArrayOfTables(list) => list.iter_mut().map(|table| table as &mut dyn TableLike).collect(),
            Item::Value(Value::Array(list)) => {
                let tables = list.iter_mut().filter_map(Value::as_inline_table_mut);
                tables.map(|table| table as &mut dyn TableLike).collect()
            }
            _ => continue,
        };
        for table in tables {
            let Some(item) = table.get_mut("markups") else { continue };
            let Some(name) = item.as_str().map(Path::new).filter(|name| name.is_relative()) else { continue };
            let path = absolute(&home.join(name));
            *item = toml_edit::value(path.to_str().ok_or("the path of the markups is not Unicode")?);
        }
    }
    Ok(())
}

/// The scene without what may differ between two files that describe it.
fn comparable(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.volume.path = None;
    if let Some(RegionSection::Zone(zone)) = &mut scene.lattice.region {
        zone.picked = None;
    }
    scene
}

fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.into())
}

/// Edits a table with the values `from` so that it has the values `to`. Keys with equal values stay
/// unchanged, whether the file contains them or not.
fn change(table: &mut dyn TableLike, from: &toml::Table, to: &toml::Table) {
    for key in from.keys().filter(|key| !to.contains_key(*key)) {
        table.remove(key);
    }
    for (key, to) in to.iter().filter(|(key, to)| from.get(*key) != Some(to)) {
        let place = table.entry(key).or_insert(Item::None);
        match (from.get(key), to) {
            // The section `output` lists every output, so it is written whole if it was missing.
            (Some(toml::Value::Table(from)), toml::Value::Table(to))
                if key != "output" || !place.is_none() =>
            {
                if place.is_none() {
                    *place = toml_edit::table();
                }
                if let Some(table) = place.as_table_like_mut() {
                    change(table, from, to);
                }
            }
            (Some(toml::Value::Array(from)), toml::Value::Array(to)) if from.len() == to.len() => {
                change_entries(place, from, to);
            }
            _ => put(place, to),
        }
    }
}

/// Edits the entries of a list in the same way.
fn change_entries(place: &mut Item, from: &[toml::Value], to: &[toml::Value]) {
    let pairs = from.iter().zip(to).enumerate().filter(|(_, (from, to))| from != to);
    for (n, pair) in pairs {
        match (pair, &mut *place) {
            ((toml::Value::Table(from), toml::Value::Table(to)), Item::ArrayOfTables(list)) => {
                list.get_mut(n).into_iter().for_each(|table| change(table, from, to));
            }
            ((toml::Value::Table(from), toml::Value::Table(to)), Item::Value(Value::Array(list))) => {
                let table = list.get_mut(n).and_then(Value::as_inline_table_mut);
                table.into_iter().for_each(|table| change(table, from, to));
            }
            ((_, to), Item::Value(Value::Array(list))) => {
                list.replace(n, value(to));
            }
            (_, place) => return put(place, &toml::Value::Array(to.to_vec())),
        }
    }
}

/// Replaces a value and keeps the comments around it.
fn put(place: &mut Item, new: &toml::Value) {
    let mut new = value(new);
    if let Item::Value(old) = place {
        *new.decor_mut() = old.decor().clone();
    }
    *place = Item::Value(new);
}

fn value(value_: &toml::Value) -> Value {
    match value_ {
        toml::Value::String(text) => text.as_str().into(),
        toml::Value::Integer(n) => (*n).into(),
        toml::Value::Float(x) => (*x).into(),
        toml::Value::Boolean(b) => (*b).into(),
        toml::Value::Datetime(time) => time.to_string().into(),
        toml::Value::Array(list) => list.iter().map(value).collect::<Array>().into(),
        toml::Value::Table(table) => table.iter().map(|(k, v)| (k, value(v))).collect::<InlineTable>().into(),
    }
}

#[cfg(test)]
mod tests {
    use cutis_solver::Formulation;

    use super::*;
    use crate::scene::Override;

    const TEXT: &str = "\
# My scene.
[volume]
path = \"ct.nii.gz\"   # the CT

[constraints.distance]
youngs_modulus_pa = 5.0e3 # firm
[constraints.stc] # skin
area_modulus_n_per_m = 5.0

[[incision]]
# where it is cut
from_mm = [30.0, 110.0, -50.0]
to_mm = [30.0, 110.0, 50.0]
depth_mm = 20.0
width_mm = 4.0
[run]
frames = 3
";

    fn loaded(text: &str, set: &[(&str, &str)]) -> LoadedScene {
        let set: Vec<Override> =
            set.iter().map(|&(key, value)| Override { key: key.into(), value: value.into() }).collect();
        Scene::parse(text, Path::new("here/scene.toml"), Path::new("here"), &set).unwrap()
    }

    #[test]
    fn unsuitable_places_and_scenes_are_refused_before_the_work() {
        let folder = tempfile::tempdir().unwrap();
        let to = |path: &str, loaded: &LoadedScene| {
            let copy = SceneCopy::to(&folder.path().join(path), path.is_empty(), loaded).map(drop);
            copy.map_err(|error| {
                assert!(error.is_bad_input());
                error.to_string()
            })
        };
        assert_eq!(to("copy.toml", &loaded(TEXT, &[])), Ok(()));
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 0, "nothing is left");
        let error = to("nowhere/copy.toml", &loaded(TEXT, &[])).unwrap_err();
        assert!(error.contains("nowhere") && error.contains("cannot be written"), "{error}");
        assert!(to("", &loaded(TEXT, &[])).unwrap_err().contains("is a folder"));
        // The text does not match the scene.
        let spoilt = LoadedScene { text: "frames = ".into(), ..loaded(TEXT, &[]) };
        let error = to("copy.toml", &spoilt).unwrap_err();
        assert!(error.contains("copy.toml"), "{error}");
    }

    #[test]
    fn only_differing_keys_are_changed() {
        let mut loaded = loaded(TEXT, &[]);
        loaded.scene.solver.substeps = 7;
        let scene = loaded.scene.clone();
        let text = edited(&loaded, &scene, Path::new("here")).unwrap();
        assert_eq!(text, format!("{TEXT}\n[solver]\nsubsteps = 7\n"));
        // Edit again, in an existing section with a comment after the number.
        loaded.text =
            text.replace("substeps = 7", "damping_per_s = 10.0 # as before\nsubsteps = 7 # too few");
        loaded.scene.solver.substeps = 9;
        let again = edited(&loaded, &loaded.scene, Path::new("here")).unwrap();
        assert_eq!(again, loaded.text.replace("substeps = 7", "substeps = 9"));
    }

    #[test]
    fn another_formulation_keeps_the_picked_steps() {
        let mut loaded = loaded(TEXT, &[]);
        let solver = &mut loaded.scene.solver;
        assert_eq!((solver.formulation, solver.substeps, solver.iterations), (Formulation::Vbd, 2, 2));
        // Two of each are not the defaults of the other formulation.
        solver.formulation = Formulation::Xpbd;
        let text = edited(&loaded, &loaded.scene, Path::new("here")).unwrap();
        assert!(text.contains("substeps = 2\n") && text.contains("iterations = 2\n"), "{text}");
    }

    #[test]
    fn a_copy_has_overrides_and_omissions() {
        let set = [
            ("incision.0.depth_mm", "25.0"),
            ("incision.0.to_mm.1", "111.0"),
            ("output.pictures", "false"),
            ("tissue.density", "\"water\""),
            ("handle", "[{ at_mm = [0, 100, 0], radius_mm = 10, move_mm = [0, 20, 0] }]"),
        ];
        let mut loaded = loaded(TEXT, &set);
        loaded.scene.constraints.stc = None;
        let text = edited(&loaded, &loaded.scene, Path::new("here")).unwrap();
        for kept in ["# My scene.", "# firm", "# where it is cut", "# the CT", "path = \"ct.nii.gz\""] {
            assert!(text.contains(kept), "no {kept:?} in {text}");
        }
        assert!(!text.contains("stc") && text.contains("depth_mm = 25.0") && text.contains("111.0, 50.0]"));
        let read = Scene::parse(&text, Path::new("copy.toml"), Path::new("here"), &[]).unwrap();
        assert_eq!(read.scene, loaded.scene);
    }

    #[test]
    fn a_volume_is_found_from_elsewhere_too() {
        let loaded = loaded(TEXT, &[]);
        let text = edited(&loaded, &loaded.scene, Path::new("elsewhere")).unwrap();
        let read = Scene::parse(&text, Path::new("copy.toml"), Path::new("elsewhere"), &[]).unwrap();
        assert_eq!(read.scene.volume.path, Some(absolute(Path::new("here/ct.nii.gz"))));
    }

    #[test]
    fn inline_sections_stay_inline() {
        let text =
            "volume = { phantom = { size = [8, 8, 8] } }\nsolver = { substeps = 3, iterations = 2 } # so\n";
        let mut loaded = loaded(text, &[]);
        loaded.scene.solver.iterations = 1;
        let copy = edited(&loaded, &loaded.scene, Path::new("here")).unwrap();
        assert_eq!(copy, text.replace("iterations = 2", "iterations = 1"));
    }
}
