//! `cutis tune`: its output, its files and its exit codes.

use serde_json::Value;

use crate::{Desk, SCENE};

const KEYS: [&str; 25] = [
    "schema",
    "cutis_version",
    "machine",
    "backend",
    "frames",
    "demand",
    "reference",
    "reference.substeps",
    "reference.differences",
    "reference.order",
    "reference.error",
    "reference.displacement_mm",
    "reference.growths_mm",
    "candidates",
    "picked.setting.substeps",
    "picked.setting.formulation",
    "picked.ms_per_frame",
    "picked.error",
    "rest.ms",
    "rest.stated_error",
    "rest.difference",
    "scene_file",
    "ledger.parts",
    "regions",
    "omissions",
];

fn tune(desk: &Desk, options: &str) -> crate::Done {
    let call = format!("tune scene.toml --set output={{}} --minutes 0.5 {options}");
    desk.cutis(&call.trim_end().split(' ').collect::<Vec<_>>())
}

#[test]
fn tune_prints_its_result_and_writes_a_copy_with_comments() {
    let desk = Desk::new();
    desk.put("scene.toml", format!("# A torso.\n{SCENE}"));
    let done = tune(&desk, "--error 40 --json").expect_success();
    let found: Value = serde_json::from_str(&done.stdout).unwrap();
    for key in KEYS {
        let value = key.split('.').try_fold(&found, |at, part| at.get(part));
        assert!(value.is_some(), "no {key} in {found:#}");
    }
    assert_eq!(
        (&found["schema"], &found["scene_file"]),
        (&"cutis-tune/1".into(), &"scene-tuned.toml".into())
    );
    let copy = std::fs::read_to_string(desk.path("scene-tuned.toml")).unwrap();
    assert!(copy.starts_with("# Tuned by cutis") && copy.contains("# A torso."), "{copy}");
    let substeps = &found["picked"]["setting"]["substeps"];
    assert!(copy.contains("[solver]") || *substeps == 10, "{copy}");
    // The copy also has the overrides of the command line.
    let run = desk.cutis(&["run", "scene-tuned.toml", "--out", "run", "--json"]).expect_success();
    let report: Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!((&report["scene"]["solver"]["substeps"], desk.names("run").len()), (substeps, 0));

    // An existing file is replaced only with `--force`.
    tune(&desk, "--error 40").expect_error(2, &["scene-tuned.toml", "--force", "-o"]);
    tune(&desk, "-o scene.toml --force").expect_error(2, &["scene.toml", "the scene itself"]);
    let done = tune(&desk, "--error 40 --force --settings-only").expect_success();
    let regions = "regions around the action";
    for words in
        ["reference", "target", "ms/frame", "opening", "> picked", "search for rest", regions, "written:"]
    {
        assert!(done.stdout.contains(words), "no {words:?} in {}", done.stdout);
    }
    let done = tune(&desk, "--error 40 --force --settings-only --whole-body").expect_success();
    assert!(!done.stdout.contains(regions), "{}", done.stdout);
    let copy = std::fs::read_to_string(desk.path("scene-tuned.toml")).unwrap();
    assert!(!copy.contains("around_mm"), "{copy}");
}

#[test]
fn tune_ends_with_one_for_unmet_targets_and_with_two_for_bad_input() {
    let desk = Desk::new();
    let done = tune(&desk, "--budget-ms 0.000001 --settings-only --json");
    assert_eq!(done.code, 1, "{}", done.stderr);
    assert!(done.stderr.contains("no setting meets the target"), "{}", done.stderr);
    let found: Value = serde_json::from_str(&done.stdout).unwrap();
    assert!(found["picked"].is_null() && found["candidates"][0]["error"].as_f64() > Some(0.0), "{found}");
    for (options, words) in [
        ("--set solver.formulation=pbd", ["scene.toml", "solver.formulation"]),
        ("--frames 0", ["scene.toml", "run.frames"]),
        ("--error 0", ["an error of 0 %", "above 0"]),
        ("--error 100", ["an error of 100 %", "below 100 %"]),
    ] {
        tune(&desk, options).expect_error(2, &words);
    }
    let both = tune(&desk, "--error 1 --budget-ms 1");
    assert!(both.code == 2 && both.stderr.contains("--help"), "{}", both.stderr);
    assert_eq!(desk.names("."), ["scene.toml"]);
}

/// A path that cannot be written is refused before any run.
#[test]
fn a_missing_folder_is_refused_before_the_work() {
    let desk = Desk::new();
    tune(&desk, "-o nowhere/tuned.toml").expect_error(2, &["nowhere/tuned.toml", "cannot be written"]);
    assert_eq!(desk.names("."), ["scene.toml"]);
}

/// The measured settings are printed although the outputs could not be timed.
#[cfg(unix)]
#[test]
fn an_unwritable_temporary_folder_loses_no_results() {
    let desk = Desk::new();
    let call =
        "TMPDIR=$PWD/nowhere $cutis tune scene.toml --set 'output={surface=true}' --minutes 0.5 --error 40";
    let done = desk.script(call).expect_success();
    let line =
        |word: &str| done.stdout.lines().find(|line| line.trim_start().starts_with(word)).map(str::to_owned);
    let outputs = line("outputs").unwrap();
    assert!(outputs.contains("not measured") && outputs.contains("nowhere"), "{outputs}");
    for word in ["distance", "volume", "written:"] {
        assert!(line(word).is_some(), "no {word:?} in {}", done.stdout);
    }
}
