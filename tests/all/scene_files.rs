//! The scenes of the repository are valid, and the scene reference is up to date.

use std::path::Path;

use cutis::Scene;
use cutis::scene::RegionSection;

use crate::scenes::{folder, names};

#[test]
fn every_fixture_scene_is_valid() {
    let scenes = names(&folder());
    assert!(scenes.len() >= 4, "{scenes:?}");
    for name in scenes {
        let loaded = Scene::load(&folder().join(&name), &[]);
        assert!(loaded.is_ok(), "{name}: {}", loaded.unwrap_err());
    }
}

#[test]
fn the_template_and_the_demo_are_valid() {
    let template = Scene::parse(cutis::scene::template(), Path::new("template"), Path::new(""), &[]).unwrap();
    let demo = cutis::demo(&[]).unwrap();
    for loaded in [template, demo] {
        // A scene that is written to a report can be read back. That the program picked its region
        // is not written.
        let text = serde_json::to_string(&loaded.scene).unwrap();
        let mut scene = loaded.scene;
        if let Some(RegionSection::Zone(zone)) = &mut scene.lattice.region {
            zone.picked = None;
        }
        assert_eq!(serde_json::from_str::<Scene>(&text).unwrap(), scene);
    }
}

/// Paths in a scene file are relative to it. Paths on the command line are relative to the current
/// folder.
#[test]
fn paths_start_where_they_are_written() {
    let scene = folder().join("abdomen-incision.toml");
    let loaded = Scene::load(&scene, &[]).unwrap();
    assert_eq!(loaded.scene.volume.path, Some(folder().join("abdomen_ts_122x101x112.nii.gz")));
    let set = crate::scenes::overrides(&[("volume.path", "here.nii")]);
    assert_eq!(Scene::load(&scene, &set).unwrap().scene.volume.path, Some("here.nii".into()));
}

#[test]
fn the_scene_reference_is_up_to_date() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/book/scene-reference.md");
    let written = std::fs::read_to_string(page).unwrap();
    let hint = "write it with `cargo run -- scene reference > docs/book/scene-reference.md`";
    assert!(written == cutis::scene::reference(), "{page} is out of date: {hint}");
}

/// The defaults of substeps and iterations are those of the formulation.
#[test]
fn a_formulation_has_its_own_substeps_and_iterations() {
    use cutis::solver::Formulation;
    let solver = |keys: &str| {
        let text = format!("volume = {{ phantom = {{ size = [8, 8, 8] }} }}\nsolver = {{ {keys} }}");
        let solver = Scene::parse(&text, Path::new("test"), Path::new(""), &[]).unwrap().scene.solver;
        (solver.formulation, solver.substeps, solver.iterations)
    };
    assert_eq!(solver(""), (Formulation::Vbd, 2, 2));
    assert_eq!(solver("formulation = 'xpbd'"), (Formulation::Xpbd, 10, 1));
    assert_eq!(solver("formulation = 'pbd', iterations = 3"), (Formulation::Pbd, 10, 3));
    assert_eq!(solver("substeps = 5"), (Formulation::Vbd, 5, 2));
}
