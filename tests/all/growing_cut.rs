//! Cuts of no width that are made while the body moves: at a time, at once or at a speed.

use std::path::Path;

use cutis::{LoadedScene, Scene};
use cutis_test_kit::gpu::on_each_adapter;

use crate::gpu::{agree, run_on};
use crate::identity::original;
use crate::scenes::{Run, SMALL, column, frames, overrides, run_in, scene};

const CONSTRAINTS: (&str, &str) = (
    "constraints",
    "{ distance = { youngs_modulus_pa = 2e4 }, volume = { bulk_modulus_pa = 1e5 }, membrane = { preset = 'trunk' } }",
);
const REPORT: (&str, &str) = ("output", "{ report = true }");
const STATE: [(&str, &str); 2] =
    [("run.checkpoint_every", "5"), ("output", "{ surface = true, report = true }")];

/// The incision of these tests with more keys, as the value of `incision`.
fn incision(keys: &str) -> String {
    format!("[{{ from_mm = [30.3, 110, -50], to_mm = [30.3, 110, 50], depth_mm = 20{keys} }}]")
}

/// The small phantom at rest with an incision, on a coarse lattice.
fn cut(keys: &str, set: &[(&str, &str)]) -> LoadedScene {
    let incision = incision(keys);
    let own = [
        CONSTRAINTS,
        REPORT,
        ("scan_is_at_rest", "true"),
        ("lattice.split", "five"),
        ("incision", incision.as_str()),
        ("solver.formulation", "vbd"),
        ("solver.substeps", "2"),
        ("solver.iterations", "2"),
    ];
    scene(SMALL, &[&own[..], set].concat())
}

/// The three formulations with few projections.
fn formulations() -> [[(&'static str, &'static str); 4]; 3] {
    let settings = |formulation, substeps, iterations| {
        [
            ("solver.formulation", formulation),
            ("solver.substeps", substeps),
            ("solver.iterations", iterations),
            ("constraints.membrane.stiffness", "0.1"),
        ]
    };
    [settings("pbd", "1", "3"), settings("xpbd", "20", "2"), settings("vbd", "2", "2")]
}

/// Until a cut begins, the body is that of the scan, to the bit. Control: once it has begun, the
/// body moves.
#[test]
fn a_cut_that_has_not_begun_moves_nothing() {
    for formulation in formulations() {
        let files = ("output", "{ volume = true }");
        // The blade sets out when the last frame begins.
        let at_last = ", at_s = 0.05, speed_mm_s = 100.0";
        let still = Run::of(&cut(at_last, &[&formulation[..], &[("run.frames", "4"), files]].concat()));
        assert_eq!(still.report.max_displacement_mm, 0.0, "{formulation:?}");
        assert!(still.deformed().voxels() == original().voxels(), "{formulation:?}");
        assert!(still.report.warnings.iter().any(|line| line.contains("incision[0] comes 0.0 of 100")));
        let earlier = ", at_s = 0.0, speed_mm_s = 1000.0";
        let moved = Run::of(&cut(earlier, &[&formulation[..], &[("run.frames", "4"), files]].concat()));
        assert!(moved.report.max_displacement_mm > 0.0, "{formulation:?}");
        assert!(moved.deformed().voxels() != original().voxels(), "{formulation:?}");
    }
}

/// The wound opens behind the tip of the blade: its middle stays closed until the blade is there.
#[test]
fn the_wound_opens_behind_the_blade() {
    let run = Run::of(&cut(", at_s = 0.05, speed_mm_s = 300.0", &[("run.frames", "30")]));
    let (time, middle) = (column(&run, "time_s"), column(&run, "gape_0_mid_mm"));
    // The border of the cut is blurred over a lattice step of 9 mm.
    let reaches = 0.05 + (50.0 - 9.0 - 9.0) / 300.0;
    for (time, middle) in time.iter().zip(&middle) {
        assert!(*time > reaches || middle.abs() < 0.2, "{middle} mm at {time} s");
    }
    assert!(*middle.last().unwrap() > 5.0, "{middle:?}");
}

/// However a cut was made, the wound ends at the same opening as one that exists from the start.
/// Control: a cut of half the length.
#[test]
fn the_opening_does_not_depend_on_how_the_cut_was_made() {
    let settled = [("run.frames", "160")];
    let opening = |keys: &str| Run::of(&cut(keys, &settled)).report.wound.unwrap().mid_mm;
    let at_start = opening("");
    for keys in [", at_s = 0.1", ", at_s = 0.1, speed_mm_s = 400.0", ", speed_mm_s = 1000.0"] {
        let later = opening(keys);
        assert!((later / at_start - 1.0).abs() < 3e-3, "{keys}: {later} instead of {at_start}");
    }
    let half = incision("").replace("-50]", "0]");
    let control = Run::of(&cut("", &[&settled[..], &[("incision", half.as_str())]].concat()));
    assert!((control.report.wound.unwrap().mid_mm / at_start - 1.0).abs() > 0.02);
}

fn read(folder: &Path, file: &str) -> Vec<u8> {
    std::fs::read(folder.join(file)).unwrap()
}

/// A run that is interrupted while the blade is on its way continues with the same bits, on any
/// number of threads. Control: another speed.
#[test]
fn a_run_resumes_in_the_middle_of_a_cut() {
    for formulation in formulations() {
        let growing = |speed: &str, frames: &str, threads: &str| {
            let keys = format!(", at_s = 0.02, speed_mm_s = {speed}");
            let own = [("run.frames", frames), ("solver.threads", threads)];
            cut(&keys, &[&STATE, &formulation[..], &own].concat())
        };
        let [whole, halves, other] = [(); 3].map(|()| tempfile::tempdir().unwrap());
        run_in(whole.path(), &growing("600.0", "10", "1"), false).unwrap();
        run_in(halves.path(), &growing("600.0", "5", "2"), false).unwrap();
        assert!(read(whole.path(), "skin.vtu") != read(halves.path(), "skin.vtu"));
        run_in(halves.path(), &growing("600.0", "10", "3"), true).unwrap();
        for file in ["checkpoint.bin", "skin.vtu"] {
            assert!(read(whole.path(), file) == read(halves.path(), file), "{formulation:?}: {file} differs");
        }
        assert_eq!(frames(whole.path()), frames(halves.path()));
        run_in(other.path(), &growing("500.0", "10", "1"), false).unwrap();
        assert!(read(whole.path(), "skin.vtu") != read(other.path(), "skin.vtu"));
    }
}

/// Two cuts that cross, one after the other, in a region of a graded lattice and with the area
/// form.
#[test]
fn a_second_cut_crosses_the_first_one_later() {
    let cross = "[{ from_mm = [30.3, 110, -50], to_mm = [30.3, 110, 50], depth_mm = 20, speed_mm_s = 1500.0 }, \
                  { from_mm = [0, 112, 2], to_mm = [60, 108, 2], depth_mm = 20, at_s = 0.1 }]";
    let zone = "{ min_mm = [-40, 40, -90], max_mm = [100, 200, 90] }";
    let area = "{ distance = { youngs_modulus_pa = 2e4 }, volume = { bulk_modulus_pa = 1e5 }, \
                 stc = { area_modulus_n_per_m = 60, amplification = 0.0, rest_area_scale = 0.85 } }";
    let cases: [&[(&str, &str)]; 3] =
        [&[("lattice.region", zone)], &[("lattice.grading", zone)], &[("constraints", area)]];
    for case in cases {
        let own = [("incision", cross), ("run.frames", "16")];
        let run = Run::of(&cut("", &[&own, case].concat()));
        let (time, second) = (column(&run, "time_s"), column(&run, "gape_1_mean_mm"));
        let before = time.iter().zip(&second).filter(|(time, _)| **time <= 0.1);
        assert!(before.clone().count() > 4);
        for wound in &run.report.wounds {
            assert!(wound.initial_mm.abs() < 1e-6 && wound.final_mm > 1.0, "{case:?}: {wound:?}");
        }
        // Skin between the halves of the second cut is one piece until it is made.
        assert!(before.clone().all(|(_, gape)| gape.abs() < 0.3 * second.last().unwrap()), "{case:?}");
    }
}

/// Both backends cut alike. Control: another speed.
#[test]
fn a_gpu_cuts_as_the_cpu_does() {
    on_each_adapter(|gpu| {
        for formulation in formulations() {
            let growing = |speed: &str| {
                let keys = format!(", at_s = 0.02, speed_mm_s = {speed}");
                let own = [
                    ("lattice.spacing_mm", "12"),
                    ("run.frames", "5"),
                    ("run.checkpoint_every", "5"),
                    ("output", "{}"),
                ];
                cut(&keys, &[&formulation[..], &own].concat())
            };
            let [cpu, on_gpu, control] = [(); 3].map(|()| tempfile::tempdir().unwrap());
            run_in(cpu.path(), &growing("1000.0"), false).unwrap();
            run_on(gpu, on_gpu.path(), &growing("1000.0"), false).unwrap();
            assert!(agree(gpu, cpu.path(), on_gpu.path()), "{formulation:?}");
            run_on(gpu, control.path(), &growing("1400.0"), false).unwrap();
            assert!(!agree(gpu, cpu.path(), control.path()), "{formulation:?}");
        }
    });
}

#[test]
fn times_and_speeds_that_are_not_possible_are_refused() {
    let refused = |keys: &str, set: &[(&str, &str)], words: [&str; 2]| {
        let incision = incision(keys);
        let all = [&[("incision", incision.as_str())], set].concat();
        let loaded = Scene::load(&crate::scenes::folder().join(SMALL), &overrides(&all));
        let error = loaded.map(|_| ()).unwrap_err();
        assert!(error.is_bad_input(), "{error}");
        let text = error.to_string();
        assert!(words.iter().all(|word| text.contains(word)), "{text}");
    };
    refused(", speed_mm_s = 0.0", &[], ["incision[0].speed_mm_s", "above 0"]);
    refused(", speed_mm_s = -1.0", &[], ["incision[0].speed_mm_s", "-1"]);
    refused(", speed_mm_s = 10.0, width_mm = 5.0", &[], ["incision[0].speed_mm_s", "width_mm"]);
    refused(", at_s = 0.1, width_mm = 5.0", &[], ["incision[0].at_s", "must be 0"]);
    refused(", at_s = 5.0", &[], ["incision[0].at_s", "run.frames"]);
    let chainmail = [("model", "chainmail"), ("constraints", "{}")];
    refused(", speed_mm_s = 10.0, width_mm = 5.0", &chainmail, ["incision[0].speed_mm_s", "width_mm"]);
}

/// Paths that no blade can follow are refused, with what to do. Control: a path that bends is cut.
#[test]
fn paths_that_are_not_possible_are_refused() {
    let run = |keys: &str| {
        let incision = format!("[{{ depth_mm = 20, {keys} }}]");
        let set = [("incision", incision.as_str()), ("run.frames", "1"), ("output", "{}")];
        let folder = tempfile::tempdir().unwrap();
        let loaded = Scene::load(&crate::scenes::folder().join(SMALL), &overrides(&set));
        loaded.and_then(|loaded| run_in(folder.path(), &loaded, false))
    };
    let bent = "path_mm = [[30, 110, -50], [40, 108, 0], [30, 110, 50]]";
    run(bent).unwrap();
    for (keys, words) in [
        ("from_mm = [30, 110, -50]".to_owned(), ["incision[0].to_mm", "path_mm"]),
        (format!("{bent}, from_mm = [30, 110, -50]"), ["incision[0].from_mm", "left out"]),
        (format!("{bent}, width_mm = 5"), ["incision[0].path_mm", "two points"]),
        ("path_mm = [[30, 110, -50]]".to_owned(), ["incision[0].path_mm", "two points"]),
        ("path_mm = [[30, 110, -50], [nan, 0, 0]]".to_owned(), ["incision[0].path_mm[1]", "finite"]),
        (
            "path_mm = [[30, 110, -50], [30, 110, 50], [30, 110, 0]]".to_owned(),
            ["`incision[0]`", "turns by 180"],
        ),
        (
            "path_mm = [[0, 110, 0], [60, 105, 0], [60, 105, 40], [30, 110, 40], [30, 110, -40]]".to_owned(),
            ["`incision[0]`", "two incisions"],
        ),
        ("path_mm = [[30, 110, -50], [30, 200, 0], [30, 110, 50]]".to_owned(), ["incision", "from the skin"]),
    ] {
        let error = run(&keys).unwrap_err();
        assert!(error.is_bad_input(), "{keys}: {error}");
        let text = error.to_string();
        assert!(words.iter().all(|word| text.contains(word)), "{keys}: {text}");
    }
}
