//! `--json` prints one JSON value with the documented keys, and nothing else, on standard output.

use serde_json::Value;

use crate::Desk;

/// Runs the program and parses the JSON value that it prints.
fn json(desk: &Desk, call: &str) -> Value {
    let done = desk.cutis(&call.split(' ').collect::<Vec<_>>()).expect_success();
    serde_json::from_str(&done.stdout).unwrap_or_else(|e| panic!("{call}: {e}: {}", done.stdout))
}

/// Fails unless the value has each dotted key. `[]` selects the first entry of a list.
fn expect_keys(value: &Value, keys: &[&str]) {
    for key in keys {
        let found = key.split('.').try_fold(value, |at, part| match part.strip_suffix("[]") {
            Some(list) => at.get(list)?.as_array()?.first(),
            None => at.get(part),
        });
        assert!(found.is_some(), "no {key} in {value:#}");
    }
}

#[test]
fn inspect() {
    let desk = Desk::new();
    desk.cutis(&["phantom", "--size", "20,16,12", "--seed", "3", "--out", "ct.nii.gz"]).expect_success();
    let found = json(&desk, "inspect ct.nii.gz --json");
    expect_keys(
        &found,
        &["shape", "spacing_mm", "affine", "dtype", "hu_min", "hu_max", "hu_sum", "nan_count", "warnings"],
    );
    assert_eq!(found["shape"], serde_json::json!([20, 16, 12]));
    assert_eq!((found["dtype"].as_str(), found["nan_count"].as_u64()), (Some("int16"), Some(0)));
    let affine = found["affine"].as_array().unwrap();
    assert!(affine.len() == 4 && affine.iter().all(|row| row.as_array().unwrap().len() == 4));
    assert_eq!((affine[0][0].as_f64(), affine[3][3].as_f64()), (Some(20.0), Some(1.0)));
    assert!(found["hu_min"].as_f64() < found["hu_max"].as_f64());
}

const SKIN_KEYS: [&str; 8] = [
    "vertices",
    "tets",
    "air_vertex_histogram",
    "triangles",
    "duplicates",
    "open_edges",
    "non_manifold_edges",
    "components",
];

#[test]
fn skin() {
    let desk = Desk::new();
    desk.cutis(&["phantom", "--size", "40,40,30", "--out", "ct.nii"]).expect_success();
    let found = json(&desk, "skin ct.nii --lattice 20,20,15 --json --out skin.vtp");
    expect_keys(&found, &SKIN_KEYS);
    assert_eq!(found["vertices"], 20 * 20 * 15);
    assert_eq!(found["tets"], 6 * 19 * 19 * 14);
    let histogram: Vec<u64> =
        found["air_vertex_histogram"].as_array().unwrap().iter().map(|n| n.as_u64().unwrap()).collect();
    assert_eq!((histogram.len(), histogram.iter().sum()), (5, found["tets"].as_u64().unwrap()));
    assert!(desk.path("skin.vtp").is_file());
    assert_ne!(
        found["triangles"],
        json(&desk, "skin ct.nii --lattice 20,20,15 --json --mode paper")["triangles"]
    );
}

/// The counts agree with those of an independent program.
#[test]
fn skin_of_a_real_abdomen() {
    let Some(volume) = cutis_test_kit::scans::find("ct/abdomen_ts_129x107x118.nii.gz") else { return };
    let found =
        json(&Desk::new(), &format!("skin {} --lattice native --mode paper --json", volume.display()));
    assert_eq!(
        found["air_vertex_histogram"],
        serde_json::json!([5_944_490, 159_059, 149_947, 158_365, 3_112_875])
    );
    let counts = ["vertices", "tets", "triangles", "duplicates"].map(|key| found[key].as_u64().unwrap());
    assert_eq!(counts, [1_628_754, 9_524_736, 148_367, 10_692]);
}

#[test]
fn check() {
    let desk = Desk::new();
    let found = json(&desk, "check scene.toml --lattice 16.0 --without stc --json");
    expect_keys(
        &found,
        &["backend.name", "sizes.vertices", "sizes.tets", "memory[].part", "memory[].bytes", "left_out[]"],
    );
    expect_keys(
        &found,
        &["ledger.parts[].part", "ledger.parts[].host_bytes", "ledger.parts[].device_bytes", "ledger.time"],
    );
    expect_keys(&found, &["ledger.parts[].ms_per_frame"]);
    let parts: Vec<&str> =
        found["ledger"]["parts"].as_array().unwrap().iter().map(|p| p["part"].as_str().unwrap()).collect();
    let expected = ["vertices", "distance", "volume", "check"];
    assert_eq!(parts, expected, "what is left out has no part");
    assert!(
        found["ledger"]["parts"][1]["host_bytes"].as_u64() == found["memory"][1]["bytes"].as_u64(),
        "{found}"
    );
    let colors: Vec<&String> = found["colors"].as_object().unwrap().keys().collect();
    assert_eq!(colors, ["distance", "volume"]);
    assert!(
        found["sizes"]["vertices"].as_u64()
            < json(&desk, "check scene.toml --json")["sizes"]["vertices"].as_u64()
    );
    assert_eq!(desk.names("."), ["scene.toml"]);
}

const REPORT_KEYS: [&str; 32] = [
    "schema",
    "cutis_version",
    "inputs[].path",
    "inputs[].sha256",
    "backend.name",
    "backend.adapter",
    "backend.reason",
    "sizes.vertices",
    "sizes.edges",
    "sizes.tets",
    "sizes.skin_triangles",
    "colors.distance",
    "colors.volume",
    "colors.stc",
    "stages[].name",
    "stages[].ms",
    "stages[].on",
    "device_memory",
    "ledger.parts[].part",
    "ledger.parts[].host_bytes",
    "ledger.parts[].device_bytes",
    "ledger.parts[].ms_per_frame",
    "ledger.time",
    "frames.count",
    "frames.ms_mean",
    "frames.ms_min",
    "wound.initial_mm",
    "wound.final_mm",
    "wound.mid_mm",
    "resample.moved_voxels",
    "resample.folds",
    "residuals[]",
];

#[test]
fn run() {
    let desk = Desk::new();
    let printed = json(&desk, "run scene.toml --out run --json");
    expect_keys(&printed, &REPORT_KEYS);
    expect_keys(&printed, &["left_out[]", "warnings"]);
    let written: Value =
        serde_json::from_slice(&std::fs::read(desk.path("run/report.json")).unwrap()).unwrap();
    assert_eq!(printed, written);
    assert_eq!(
        (printed["frames"]["count"].as_u64(), printed["schema"].as_str()),
        (Some(2), Some("cutis-report/1"))
    );
    assert!(printed["wound"]["final_mm"].as_f64() > printed["wound"]["initial_mm"].as_f64());

    // The report has all required keys of its schema, and the schema describes all keys of the
    // report.
    let schema = json(&desk, "scene report-schema");
    let described = schema["properties"].as_object().unwrap();
    assert!(written.as_object().unwrap().keys().all(|key| described.contains_key(key)));
    let required = schema["required"].as_array().unwrap();
    assert!(required.len() > 10 && required.iter().all(|key| written.get(key.as_str().unwrap()).is_some()));
}
