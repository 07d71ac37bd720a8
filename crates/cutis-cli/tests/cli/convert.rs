//! `cutis convert`, and `cutis inspect` of a folder.

use serde_json::Value;

use crate::Desk;

fn call(desk: &Desk, words: &[&str]) -> Value {
    let done = desk.cutis(words).expect_success();
    serde_json::from_str(&done.stdout).unwrap_or_else(|e| panic!("{words:?}: {e}: {}", done.stdout))
}

#[test]
fn every_format_holds_the_same_volume() {
    let desk = Desk::new();
    desk.cutis(&["phantom", "--size", "20,16,12", "--out", "ct.nii.gz"]).expect_success();
    let original = call(&desk, &["inspect", "ct.nii.gz", "--json"]);
    for name in ["a.nrrd", "a.nhdr", "a.mha", "a.mhd", "a.nii"] {
        desk.cutis(&["convert", "ct.nii.gz", "--out", name]).expect_success();
        let found = call(&desk, &["inspect", name, "--json"]);
        for key in ["shape", "hu_sum", "hu_min", "hu_max", "orientation", "dtype"] {
            assert_eq!(found[key], original[key], "{name} {key}");
        }
    }
    desk.cutis(&["convert", "ct.nii.gz", "--out", "a.png"]).expect_error(2, &["a.png", ".nrrd"]);
    desk.cutis(&["convert", "missing.nii", "--out", "b.nrrd"]).expect_error(2, &["missing.nii"]);
    assert!(!desk.path("a.png").exists() && !desk.path("b.nrrd").exists());
}

/// From a volume to a wound without a number from the user.
#[test]
fn a_new_scene_of_a_volume_has_a_cut_that_opens() {
    let desk = Desk::new();
    desk.cutis(&["phantom", "--size", "64,64,48", "--out", "small.nii.gz"]).expect_success();
    let scene = desk.cutis(&["scene", "new", "small.nii.gz"]).expect_success().stdout;
    desk.put("first.toml", scene);
    let report = call(
        &desk,
        &["settle", "first.toml", "--set", "lattice.spacing_mm=8", "--set", "output={}", "--json"],
    );
    assert!(report["wound"]["mid_mm"].as_f64().unwrap() > 1.0, "{}", report["wound"]);
    desk.cutis(&["scene", "new", "missing.nii"]).expect_error(2, &["missing.nii"]);
    let plain = desk.cutis(&["scene", "new"]).expect_success().stdout;
    assert!(plain.contains("path = \"ct.nii.gz\""), "{plain}");
}

#[cfg(feature = "dicom")]
#[test]
fn a_folder_lists_its_series() {
    let desk = Desk::new();
    std::fs::create_dir(desk.path("empty")).unwrap();
    desk.cutis(&["inspect", "empty"]).expect_error(2, &["empty", "no CT series"]);
    let Some(head) = cutis_test_kit::scans::find("dicom/head_tilt_variable_spacing") else { return };
    let head = head.to_str().unwrap();
    let found = call(&desk, &["inspect", head, "--json"]);
    let series = &found["series"][0];
    assert_eq!((series["number"].as_u64(), series["slices"].as_u64()), (Some(2), Some(28)));
    assert!(
        series["problem"].as_str().unwrap().contains("gantry tilt") && found["volume"].is_null(),
        "{found}"
    );
    let resampled = call(&desk, &["inspect", head, "--resample", "--json"]);
    assert_eq!(resampled["volume"]["shape"], serde_json::json!([512, 611, 113]));
    assert_eq!(resampled["series"][0], *series);
    let text = desk.cutis(&["inspect", head]).expect_success().stdout;
    for part in
        ["series 2", "28 slices", "512 x 512 pixels", "1.081 to 6.999 mm apart", "tilted by 18.5 degrees"]
    {
        assert!(text.contains(part), "{part}: {text}");
    }
    desk.cutis(&["inspect", head, "--series", "5"])
        .expect_error(2, &["no series with the number 5", "series 2"]);
}
