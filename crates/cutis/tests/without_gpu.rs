//! A build without the feature `gpu` refuses a GPU by name, and `auto` and `devices` say what it
//! lacks.
#![cfg(not(feature = "gpu"))]

use cutis::scene::BackendChoice;
use cutis::{Error, LoadedScene, Override, Silent};

fn small(backend: BackendChoice) -> LoadedScene {
    let set = [("volume.phantom.size", "[48, 48, 36]"), ("lattice.spacing_mm", "14")];
    let overrides = set.map(|(key, value)| Override { key: key.into(), value: value.into() });
    let mut loaded = cutis::demo(&overrides).unwrap();
    loaded.scene.solver.backend = backend;
    loaded
}

#[test]
fn a_gpu_is_refused_and_auto_selects_the_cpu() {
    let error = cutis::check(&small(BackendChoice::Gpu), &Silent).unwrap_err();
    assert!(error.is_bad_input() && matches!(error, Error::SceneSection { .. }), "{error:?}");
    let text = error.to_string();
    for word in ["demo.toml", "solver.backend", "no GPU backend", "\"cpu\""] {
        assert!(text.contains(word), "no {word:?} in: {text}");
    }
    let plan = cutis::check(&small(BackendChoice::Auto), &Silent).unwrap();
    assert_eq!(plan.backend.name, "cpu");
    assert!(plan.backend.reason.contains("no GPU backend"), "{}", plan.backend.reason);
    assert!(
        plan.left_out.iter().any(|line| line == "gpu: this build has no GPU backend"),
        "{:?}",
        plan.left_out
    );
}

#[test]
fn the_list_of_devices_names_the_missing_feature() {
    let found = cutis::devices();
    assert!(!found.gpu_backend && found.devices.is_empty() && found.auto.is_none());
    assert!(found.note.contains("feature `gpu`"), "{}", found.note);
}
