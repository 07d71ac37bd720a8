//! Paths of cuts, pairs of stitches and ways of handles that were drawn in another program, such as
//! markups of 3D Slicer.
//!
//! Reading a scene puts the points of the file in place of its name, so that no other code knows of
//! such files, and a report holds the points that were cut.

use std::path::{Path, PathBuf};

use cutis_skin::{DrawnPairs, DrawnPath};

use super::{Override, Scene, SceneFile};
use crate::Error;

/// Reads the files that cuts, sutures and handles of a scene name. Relative names start from
/// `directory`, and those of overrides from the present folder. Returns what was skipped in the
/// files.
///
/// # Errors
/// [`Error::SceneKey`] for a file next to points, [`Error::SceneSection`] for a file that is not
/// one path, or not pairs of points.
pub(super) fn fill(
    scene: &mut Scene,
    file: SceneFile<'_>,
    directory: &Path,
    overrides: &[Override],
) -> Result<Vec<String>, Error> {
    let mut notes = Vec::new();
    let reader = Reader { file, directory, overrides };
    for (n, incision) in scene.incision.iter_mut().enumerate() {
        let Some(name) = incision.markups.take() else { continue };
        let key = format!("incision[{n}].markups");
        let has_points =
            incision.from_mm.is_some() || incision.to_mm.is_some() || !incision.path_mm.is_empty();
        let why = "must be left out next to from_mm, to_mm and path_mm: give the points or the file";
        incision.path_mm = reader.points(&key, name, has_points.then_some(why), &mut notes)?;
    }
    for (n, excision) in scene.excision.iter_mut().enumerate() {
        let Some(name) = excision.markups.take() else { continue };
        let key = format!("excision[{n}].markups");
        let why = "must be left out next to path_mm: give the points or the file";
        let has_points = !excision.path_mm.is_empty();
        excision.path_mm = reader.points(&key, name, has_points.then_some(why), &mut notes)?;
    }
    for (n, suture) in scene.suture.iter_mut().enumerate() {
        let Some(name) = suture.markups.take() else { continue };
        let key = format!("suture[{n}].markups");
        let why = "must be left out next to every_mm and pairs_mm: give one of the three";
        let has_points = suture.every_mm.is_some() || !suture.pairs_mm.is_empty();
        let drawn = reader.pairs(&key, name, has_points.then_some(why), &mut notes)?;
        suture.pairs_mm = drawn.pairs_mm().iter().map(|pair| pair.map(Into::into)).collect();
    }
    for (n, handle) in scene.handle.iter_mut().enumerate() {
        let Some(name) = handle.markups.take() else { continue };
        let key = format!("handle[{n}].markups");
        let why = "must be left out next to at_mm and move_mm: give the points or the file";
        let has_points = handle.at_mm.is_some() || handle.move_mm.is_some();
        let drawn = reader.pairs(&key, name, has_points.then_some(why), &mut notes)?;
        let [from, to] = drawn.one().map_err(file.blame(&key))?;
        (handle.at_mm, handle.move_mm) = (Some(from.into()), Some((to - from).into()));
    }
    Ok(notes)
}

struct Reader<'a> {
    file: SceneFile<'a>,
    directory: &'a Path,
    overrides: &'a [Override],
}

impl Reader<'_> {
    /// The points of the path in a file. `wrong` says why there must be no file.
    fn points(
        &self,
        key: &str,
        name: PathBuf,
        wrong: Option<&str>,
        notes: &mut Vec<String>,
    ) -> Result<Vec<[f64; 3]>, Error> {
        let path = self.path(key, name, wrong)?;
        let drawn = DrawnPath::read(&path).map_err(self.file.blame(key))?;
        notes.extend(drawn.warnings().iter().map(|line| format!("{}: {line}", path.display())));
        Ok(drawn.points_mm().iter().map(|&point| point.into()).collect())
    }

    /// The pairs of points in a file. `wrong` says why there must be no file.
    fn pairs(
        &self,
        key: &str,
        name: PathBuf,
        wrong: Option<&str>,
        notes: &mut Vec<String>,
    ) -> Result<DrawnPairs, Error> {
        let path = self.path(key, name, wrong)?;
        let drawn = DrawnPairs::read(&path).map_err(self.file.blame(key))?;
        notes.extend(drawn.warnings().iter().map(|line| format!("{}: {line}", path.display())));
        Ok(drawn)
    }

    /// The path of a file.
    fn path(&self, key: &str, name: PathBuf, wrong: Option<&str>) -> Result<PathBuf, Error> {
        if let Some(why) = wrong {
            return Err(self.file.bad_key(key, &format!("{name:?}"), why));
        }
        let plain = |key: &str| key.replace('[', ".").replace(']', "");
        let named = plain(&self.file.steps.name(key));
        let overridden = self.overrides.iter().any(|given| {
            let given = plain(&given.key);
            named == given || named.starts_with(&format!("{given}."))
        });
        Ok(if name.is_relative() && !overridden { self.directory.join(name) } else { name })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LoadedScene;

    /// A curve along the belly of the phantom.
    const CURVE: &str = r#"{"markups": [{"type": "Curve", "coordinateSystem": "LPS", "controlPoints": [
        {"position": [-30, -110, -50]}, {"position": [-30, -110, 50]}]}, {"type": "ROI"}]}"#;

    /// A folder with `cut.mrk.json`.
    fn folder(text: &str) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("cut.mrk.json"), text).unwrap();
        folder
    }

    fn load(folder: &Path, scene: &str, set: &[(&str, &str)]) -> Result<LoadedScene, Error> {
        let text = format!("volume = {{ phantom = {{ size = [8, 8, 8] }} }}\n{scene}");
        let given = |&(key, value): &(&str, &str)| Override { key: key.into(), value: value.into() };
        let overrides: Vec<Override> = set.iter().map(given).collect();
        Scene::parse(&text, Path::new("scene.toml"), folder, &overrides)
    }

    #[test]
    fn points_of_a_file_stand_in_the_scene() {
        let here = folder(CURVE);
        let expected = vec![[30.0, 110.0, -50.0], [30.0, 110.0, 50.0]];
        let incision = "[[incision]]\nmarkups = \"cut.mrk.json\"\ndepth_mm = 5";
        let step = "[[step]]\nkind = \"incise\"\nmarkups = \"cut.mrk.json\"\ndepth_mm = 5";
        for scene in [incision, step] {
            let loaded = load(here.path(), scene, &[]).unwrap();
            assert_eq!(loaded.scene.incision[0].path(), expected);
            assert_eq!(loaded.scene.incision[0].markups, None);
            let [note] = &loaded.notes[..] else { panic!("{:?}", loaded.notes) };
            assert!(note.contains("cut.mrk.json: 1 markups are not paths"), "{note}");
        }
        let closed =
            CURVE.replace("Curve", "ClosedCurve").replace("50]}]", "50]}, {\"position\": [0, 0, 0]}]");
        std::fs::write(here.path().join("cut.mrk.json"), closed).unwrap();
        let excision = "[[excision]]\nmarkups = \"cut.mrk.json\"\ndepth_mm = 5";
        let outline = &load(here.path(), excision, &[]).unwrap().scene.excision[0].path_mm;
        assert_eq!((outline.len(), outline[0]), (4, outline[3]));
    }

    /// Names in a scene start from its folder, and names in an override from the present folder.
    #[test]
    fn a_name_starts_from_the_place_where_it_stands() {
        let here = folder(CURVE);
        let scene = "[[incision]]\ndepth_mm = 5";
        let missing = |set: &[(&str, &str)]| load(here.path(), scene, set).unwrap_err().to_string();
        for set in [
            [("incision[0].markups", "cut.mrk.json")],
            [("incision.0.markups", "cut.mrk.json")],
            [("incision", "[{ markups = \"cut.mrk.json\", depth_mm = 5 }]")],
        ] {
            let message = missing(&set);
            assert!(message.contains("cannot read cut.mrk.json"), "{message}");
        }
        let absolute = here.path().join("cut.mrk.json");
        let set = [("incision[0].markups", absolute.to_str().unwrap())];
        assert_eq!(load(Path::new("elsewhere"), scene, &set).unwrap().scene.incision[0].path_mm.len(), 2);
        let relative = "[[incision]]\ndepth_mm = 5\nmarkups = \"cut.mrk.json\"";
        assert!(load(here.path(), relative, &[]).is_ok());
        let message = load(Path::new("elsewhere"), relative, &[]).unwrap_err().to_string();
        assert!(
            message.contains("elsewhere/cut.mrk.json") && message.contains("incision[0].markups"),
            "{message}"
        );
    }

    /// Two points, in LPS, as a line of 3D Slicer.
    const LINE: &str = r#"{"markups": [{"type": "Line", "coordinateSystem": "LPS", "controlPoints": [
        {"position": [-30, -110, -5]}, {"position": [-25, -112, 5]}]}]}"#;
    const CUT: &str = "[[incision]]\npath_mm = [[0, 9, 0], [9, 9, 0]]\ndepth_mm = 5\n";

    #[test]
    fn a_line_is_the_way_of_a_handle() {
        let here = folder(LINE);
        for scene in ["[[handle]]", "[[step]]\nkind = \"hook\""] {
            let scene = format!("{scene}\nmarkups = \"cut.mrk.json\"\nradius_mm = 9");
            let handle = load(here.path(), &scene, &[]).unwrap().scene.handle[0].clone();
            assert_eq!(
                (handle.center_mm(), handle.displacement_mm()),
                ([30.0, 110.0, -5.0], [-5.0, 2.0, 10.0])
            );
            assert_eq!(handle.markups, None);
        }
    }

    #[test]
    fn lines_and_lists_of_points_are_stitches() {
        let list = LINE
            .replace("Line", "Fiducial")
            .replace("5]}]}", "5]}, {\"position\": [1, 2, 3]}, {\"position\": [4, 5, 6]}]}");
        for (file, count) in [(LINE.to_owned(), 1), (list, 2)] {
            let here = folder(&file);
            let scene = format!("{CUT}[[suture]]\nwound = 0\nmarkups = \"cut.mrk.json\"");
            let suture = load(here.path(), &scene, &[]).unwrap().scene.suture[0].clone();
            assert_eq!((suture.pairs_mm.len(), suture.markups), (count, None));
            assert_eq!(suture.pairs_mm[0], [[30.0, 110.0, -5.0], [25.0, 112.0, 5.0]]);
        }
    }

    #[test]
    fn files_without_pairs_are_refused_with_their_key() {
        let handle = "[[handle]]\nradius_mm = 9\n";
        let three = LINE.replace("5]}]}", "5]}, {\"position\": [1, 2, 3]}]}");
        let two = LINE
            .replace("Line", "Fiducial")
            .replace("5]}]}", "5]}, {\"position\": [1, 2, 3]}, {\"position\": [4, 5, 6]}]}");
        let markups = "markups = \"cut.mrk.json\"\n";
        let suture = format!("{CUT}[[suture]]\nwound = 0\n");
        for (file, scene, words) in [
            (LINE, format!("{handle}{markups}at_mm = [0, 0, 0]"), ["handle[0].markups", "at_mm"]),
            (LINE, format!("{suture}{markups}every_mm = 9"), ["suture[0].markups", "every_mm"]),
            (LINE, format!("{handle}at_mm = [0, 0, 0]"), ["handle[0].move_mm", "or markups"]),
            (&three, format!("{handle}{markups}"), ["handle[0].markups", "3 points"]),
            (&two, format!("{handle}{markups}"), ["handle[0].markups", "2 pairs"]),
            (&three, format!("{suture}{markups}"), ["suture[0].markups", "even number"]),
            (LINE, suture.clone(), ["suture[0].every_mm", "must be given"]),
        ] {
            let here = folder(file);
            let message = load(here.path(), &scene, &[]).unwrap_err().to_string();
            assert!(words.iter().all(|word| message.contains(word)), "{words:?}: {message}");
        }
    }

    #[test]
    fn a_file_that_is_not_one_path_is_refused_with_its_key() {
        let both = "[[incision]]\nmarkups = \"cut.mrk.json\"\ndepth_mm = 5\n";
        let step = "[[step]]\nkind = \"incise\"\nmarkups = \"cut.mrk.json\"\ndepth_mm = 5";
        let excision = "[[excision]]\nmarkups = \"cut.mrk.json\"\ndepth_mm = 5";
        let two = CURVE.replace("ROI", "Line").replace(
            "}]}, {",
            "}]}, {\"controlPoints\": [{\"position\": [0, 0, 0]}, {\"position\": [9, 0, 0]}], ",
        );
        for (file, scene, words) in [
            (CURVE, format!("{both}path_mm = [[0, 0, 0], [1, 0, 0]]"), ["incision[0].markups", "path_mm"]),
            (CURVE, format!("{both}to_mm = [0, 0, 0]"), ["incision[0].markups", "to_mm"]),
            (CURVE, format!("{both}at_s = -1"), ["incision[0].at_s", "0 or more"]),
            (CURVE, excision.to_owned(), ["excision[0].path_mm", "closed outline"]),
            (&two, both.to_owned(), ["incision[0].markups", "2 paths"]),
            ("{", step.to_owned(), ["step[0].markups", "line 1"]),
            ("", both.to_owned(), ["incision[0].markups", "no stroke"]),
        ] {
            let here = folder(file);
            let message = load(here.path(), &scene, &[]).unwrap_err().to_string();
            assert!(words.iter().all(|word| message.contains(word)), "{words:?}: {message}");
        }
    }
}
