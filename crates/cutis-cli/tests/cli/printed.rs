//! The output of `cutis scene` is valid without changes, and tables show what they must.

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
    for (what, key) in [("schema", "constraints"), ("report-schema", "wounds"), ("study-schema", "axis")] {
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

const LAYERED: [&str; 6] =
    ["--set", "materials=layered", "--set", "constraints.distance={}", "--set", "constraints.volume={}"];

/// `cutis check` prints each row of the table with its counts. The report has the same rows with
/// their sources.
#[test]
fn materials_are_printed_and_reported_with_their_sources() {
    let desk = Desk::new();
    let call = |first: &[&str]| desk.cutis(&[first, &LAYERED].concat()).expect_success().stdout;
    let printed = call(&["check", "scene.toml"]);
    let lines: Vec<&str> = printed.lines().collect();
    let title = lines.iter().position(|line| line.starts_with("materials (")).unwrap();
    let report: Value = serde_json::from_str(&call(&["run", "scene.toml", "--json"])).unwrap();
    let rows = report["materials"].as_array().unwrap();
    assert_eq!(rows.len(), 4);
    for (n, row) in rows.iter().enumerate() {
        let of_row = lines[title + 2 + n].trim();
        let words: Vec<&str> = of_row.split_whitespace().collect();
        assert!(of_row.starts_with(row["name"].as_str().unwrap()), "{of_row}");
        let counts = ["vertices", "tets"].map(|key| row[key].as_u64().unwrap().to_string());
        assert_eq!(words[words.len() - 2..], counts, "{of_row}");
    }
    assert!(lines[title + 2].contains("0 to 2"), "{printed}");
    let page = std::fs::read_to_string(desk.path("scene-run/report.html")).unwrap();
    assert!(page.contains("<h2>Materials</h2>") && page.contains("Samani 2007"));
    // Control: a scene without a table has none.
    let plain = desk.cutis(&["check", "scene.toml"]).expect_success().stdout;
    assert!(!plain.contains("materials (") && plain.contains(", materials, "), "{plain}");
}

/// `| head` closes the pipe early, which is not an error.
#[test]
fn a_closed_pipe_causes_no_panic() {
    let done = Desk::new().script("set -o pipefail; \"$cutis\" scene schema | true");
    assert_eq!(done.code, 0, "{}", done.stderr);
}
