//! The output of `cutis scene` is valid without changes.

use std::path::Path;

use serde_json::Value;

use crate::Desk;

#[test]
fn a_new_scene_is_a_scene() {
    let printed = Desk::new().cutis(&["scene", "new"]).expect_success().stdout;
    let loaded = cutis::Scene::parse(&printed, Path::new("new.toml"), Path::new(""), &[]).unwrap();
    assert_eq!(loaded.scene.incision.len(), 1);
}

#[test]
fn schemas_are_json_schemas() {
    for (what, key) in [("schema", "constraints"), ("report-schema", "wounds")] {
        let printed = Desk::new().cutis(&["scene", what]).expect_success().stdout;
        let schema: Value = serde_json::from_str(&printed).unwrap();
        assert!(schema["$schema"].as_str().is_some_and(|s| s.contains("json-schema.org")), "{what}");
        assert!(schema["properties"][key].is_object(), "{what}");
    }
}

#[test]
fn the_reference_is_printed_to_the_byte() {
    let printed = Desk::new().cutis(&["scene", "reference"]).expect_success().stdout;
    assert!(printed == cutis::scene::reference());
}

/// `| head` closes the pipe early, which is not an error.
#[test]
fn a_closed_pipe_causes_no_panic() {
    let done = Desk::new().script("set -o pipefail; \"$cutis\" scene schema | true");
    assert_eq!(done.code, 0, "{}", done.stderr);
}
