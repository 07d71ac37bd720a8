//! Invalid chain scenes are refused with the key's name before any file is written.

use cutis::tune::Demand;
use cutis::{Error, Scene, Silent, TuneOptions};

use super::*;
use crate::scenes::{folder, overrides};

/// The key that the error names, and its message.
fn refused(set: &[(&str, &str)]) -> (String, String) {
    let common = [
        ("model", "chainmail"),
        ("volume", CT_FILE.as_str()),
        ("constraints", "{}"),
        ("lattice.spacing_mm", "16"),
    ];
    let loaded = Scene::load(&folder().join(SMALL), &overrides(&[&common, set].concat()));
    let checked = loaded.and_then(|loaded| cutis::check(&loaded, &Silent));
    let Err(error) = checked else { panic!("{set:?} was accepted") };
    let text = error.to_string();
    assert!(error.is_bad_input() && text.contains(SMALL), "{text}");
    let Error::SceneKey { key, .. } = error else { panic!("{set:?}: {text}") };
    (key, text)
}

#[test]
fn invalid_materials_are_refused() {
    let soft = "shortest = 0.5, longest = 1.5, shear = 0.5";
    let list = |entries: &[&str]| {
        let entries: Vec<String> = entries.iter().map(|entry| format!("{{ {entry} }}")).collect();
        format!("[{}]", entries.join(", "))
    };
    let first = format!("from_hu = -1024, {soft}");
    let second = |from: &str| list(&[&first, &format!("from_hu = {from}, {soft}")]);
    let many: Vec<String> = (0..65).map(|n| format!("from_hu = {}, {soft}", n - 1024)).collect();
    let many: Vec<&str> = many.iter().map(String::as_str).collect();
    let cases: [(String, &str, &[&str]); 18] = [
        ("\"muscle\"".into(), "", &["muscle", "tissue", "uniform"]),
        ("[]".into(), "", &["0 materials", "64"]),
        (list(&many), "", &["65 materials", "64"]),
        (second("-1024"), "[1].from_hu", &["-1024", "above"]),
        (second("-1025"), "[1].from_hu", &["-1025", "above"]),
        (second("nan"), "[1].from_hu", &["NaN", "finite"]),
        (list(&[&format!("from_hu = -400, {soft}")]), "", &["-400", "tissue.air_below_hu = -449"]),
        (
            list(&["from_hu = -1024, shortest = 1.5, longest = 1.5, shear = 0"]),
            "[0].shortest",
            &["1.5", "0 to 1"],
        ),
        (
            list(&[&first, "from_hu = 0, shortest = [1, nan, 1], longest = 1.5, shear = 0"]),
            "[1].shortest",
            &["NaN", "0 to 1"],
        ),
        (
            list(&["from_hu = -1024, shortest = 1, longest = 0.9, shear = 0"]),
            "[0].longest",
            &["0.9", "1 to 16"],
        ),
        (list(&["from_hu = -1024, shortest = 1, longest = 1, shear = -1"]), "[0].shear", &["-1", "0 to 16"]),
        (list(&[&format!("{first}, k_steps = nan")]), "[0].k_steps", &["NaN", "0 to 4096"]),
        (list(&["from_hu = -1024, shortest = 1, longest = 1"]), "[0].shear", &["is missing"]),
        (list(&[&first, &format!("from_hu = 0, {soft}, k = 0.1")]), "[1].k", &["`k`", "k_steps"]),
        (
            list(&["from_hu = -1024, shortest = [1, 1], longest = 1, shear = 0"]),
            "[0].shortest",
            &["length 2", "length 3"],
        ),
        (
            list(&["from_hu = -1024, shortest = 1, longest = \"far\", shear = 0"]),
            "[0].longest",
            &["far", "a number, or three"],
        ),
        ("[\"tissue\"]".into(), "[0]", &["tissue"]),
        ("5".into(), "", &["5", "the name of a preset, or a list"]),
    ];
    for (value, place, words) in cases {
        let (key, text) = refused(&[("chainmail.materials", &value)]);
        assert_eq!(key, format!("chainmail.materials{place}"), "{text}");
        assert!(words.iter().all(|word| text.contains(word)), "{words:?} in {text}");
    }
    // The largest allowed number of materials. The first one begins where tissue begins.
    let tissue = list(&[&format!("from_hu = -449, {soft}")]);
    cutis::check(&chain(&[("chainmail.materials", &tissue)]), &Silent).unwrap();
    cutis::check(&chain(&[("chainmail.materials", &list(&many[..64]))]), &Silent).unwrap();
}

#[test]
fn invalid_times_zones_and_handles_are_refused() {
    const HANDLE_AT: &str = "at_mm = [-40, 100, 0], radius_mm = 15";
    let one = |rest: &str| format!("[{{ {HANDLE_AT}, {rest} }}]");
    let two = format!(
        "[{{ {HANDLE_AT}, move_mm = [1, 0, 0] }}, {{ at_mm = [-30, 95, 0], radius_mm = 15, move_mm = [2, 0, 0] }}]"
    );
    let [far, farther, huge] =
        ["[0, 1e9, 0]", "[0, 0, -70000]", "[1e300, 0, 0]"].map(|by| one(&format!("move_mm = {by}")));
    /// Overrides, the key that the error names, and a part of its message.
    type Refused<'a> = (&'a [(&'a str, &'a str)], &'a str, &'a str);
    let cases: [Refused<'_>; 12] = [
        (&[("lattice.grading", "{ around_mm = 25 }")], "lattice.grading", "chainmail"),
        (&[("model", "pbd"), ("incision.0.at_s", "0.1")], "incision[0].at_s", "pbd"),
        (&[("incision.0.at_s", "-0.1")], "incision[0].at_s", "-0.1"),
        (&[("incision.0.at_s", "nan")], "incision[0].at_s", "NaN"),
        // The scene lasts 40 frames of 1/60 s.
        (&[("incision.0.at_s", "0.651")], "incision[0].at_s", "0.65 s"),
        (&[("incision.0.at_s", "0.01"), ("run.frames", "0")], "incision[0].at_s", "run.frames"),
        (&[("handle", &two)], "handle[1].at_mm", "handle[0]"),
        (
            &[("handle", "[{ at_mm = [0, 0, 500], radius_mm = 5, move_mm = [1, 0, 0] }]")],
            "handle[0].at_mm",
            "no tissue",
        ),
        (&[("handle", &far)], "handle[0].move_mm", "4096"),
        (&[("handle", &farther)], "handle[0].move_mm", "4096"),
        (&[("handle", &huge)], "handle[0].move_mm", "4096"),
        (&[("handle", &one("move_mm = [0, nan, 0]"))], "handle[0].move_mm", "finite"),
    ];
    for (set, expected, word) in cases {
        let (key, text) = refused(set);
        assert!(key == expected && text.contains(word), "{set:?}: {text}");
    }
    cutis::check(&scenes::scene(SMALL, &[("model", "chainmail"), ("incision.0.at_s", "0.65")]), &Silent)
        .unwrap();
    let allowed = one("move_mm = [0, 0, -40000]");
    cutis::check(&chain(&[("handle", &allowed)]), &Silent).unwrap();
}

/// A thread needs a force, and links have none. Control: the other model has sutures.
#[test]
fn sutures_are_refused() {
    let incision = "[{ from_mm = [0, 110, -50], to_mm = [0, 110, 50], depth_mm = 20 }]";
    let suture = "[{ wound = 0, every_mm = 20 }]";
    let (key, text) = refused(&[("incision", incision), ("suture", suture)]);
    assert_eq!(key, "suture", "{text}");
    assert!(["1 suture", "must be left out", "pbd"].iter().all(|word| text.contains(word)), "{text}");
    let set = [("incision", incision), ("suture", suture), ("lattice.spacing_mm", "16")];
    cutis::check(&scenes::scene(SMALL, &set), &Silent).unwrap();
}

#[test]
fn a_chain_has_no_system_to_build_or_to_tune() {
    let out = tempfile::tempdir().unwrap();
    let loaded = chain(&[HANDLE]);
    let options = TuneOptions {
        demand: Demand::BudgetMs(10.0),
        out: out.path().join("tuned.toml"),
        overwrite: false,
        minutes: 0.1,
        region: false,
        omissions: false,
    };
    let errors = [cutis::build_system(&loaded).err(), cutis::tune(&loaded, &options, &Silent).err()];
    for error in errors.map(Option::unwrap) {
        assert!(error.is_bad_input(), "{error}");
        assert!(matches!(&error, Error::SceneKey { key, .. } if key == "model"), "{error}");
        assert!(error.to_string().contains("chainmail"), "{error}");
    }
    assert!(scenes::names(out.path()).is_empty());
}
