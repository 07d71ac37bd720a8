//! A run of a tuned scene has the predicted error, opening and time. The error is measured against
//! a finer reference of this test.

use std::path::{Path, PathBuf};

use cutis::report::Report;
use cutis::scene::{LatticeSection, RegionSection, WholeBody};
use cutis::solver::{Formulation, Settings, Solver};
use cutis::solver_cpu::SolverCpu;
use cutis::tune::Demand;
use cutis::{Error, LoadedScene, Scene, Silent, TuneOptions, Tuning};
use nalgebra::Point3;

use crate::scenes::{self, SMALL, run_in, state_of};

/// The small phantom on a coarser lattice, for a shorter time in which it still comes to rest.
fn scene(set: &[(&str, &str)]) -> LoadedScene {
    let quick = [
        ("lattice.spacing_mm", "17"),
        ("incision.0.width_mm", "14"),
        ("solver.damping_per_s", "40"),
        ("run.frames", "16"),
        ("output", "{ report = true }"),
    ];
    scenes::scene(SMALL, &[&quick, set].concat())
}

fn options(out: PathBuf, demand: Demand) -> TuneOptions {
    TuneOptions { demand, out, overwrite: false, minutes: 0.3, region: false, omissions: false }
}

/// Options without a time limit.
fn tuned(loaded: &LoadedScene, folder: &Path, demand: Demand) -> (Tuning, LoadedScene) {
    let options = TuneOptions { minutes: 30.0, ..options(folder.join("tuned.toml"), demand) };
    let tuning = cutis::tune(loaded, &options, &Silent).unwrap();
    let tuned = Scene::load(&folder.join("tuned.toml"), &[]).unwrap();
    (tuning, tuned)
}

/// Positions in the checkpoint of a folder, in local meters.
fn state(folder: &Path) -> Vec<Point3<f64>> {
    let bytes = std::fs::read(folder.join("checkpoint.bin")).unwrap();
    let [positions, _] = state_of(&bytes);
    let values = positions.chunks_exact(4).map(|b| f64::from(f32::from_le_bytes(b.try_into().unwrap())));
    values.collect::<Vec<f64>>().chunks_exact(3).map(|p| Point3::new(p[0], p[1], p[2])).collect()
}

/// A run in double precision with the scene's formulation and many substeps: rest positions, final
/// positions, and movable vertices.
fn reference(loaded: &LoadedScene, substeps: u32) -> [Vec<Point3<f64>>; 2] {
    let built = cutis::build_system(loaded).unwrap();
    let system = built.system.to_f64();
    let free = |places: Vec<Point3<f64>>| -> Vec<Point3<f64>> {
        let vertices = built.system.vertices().iter();
        places.into_iter().zip(vertices).filter(|(_, v)| v.inverse_mass() > 0.0).map(|(p, _)| p).collect()
    };
    let rest = system.positions();
    let settings = Settings {
        formulation: Formulation::Xpbd,
        substeps,
        iterations: 1,
        relaxation: 1.0,
        ..built.settings
    };
    let mut solver = SolverCpu::new(system, settings, None).unwrap();
    solver.step(loaded.scene.run.frames as usize).unwrap();
    [free(rest), free(solver.positions().unwrap())]
}

fn rms(a: &[Point3<f64>], b: &[Point3<f64>]) -> f64 {
    (a.iter().zip(b).map(|(a, b)| (a - b).norm_squared()).sum::<f64>() / a.len() as f64).sqrt()
}

/// Times of the same work may differ by this factor while other tests run.
const BUSY: f64 = 3.0;

fn near(found: f64, promised: f64) -> bool {
    (found - promised).abs() <= 0.2 * promised.abs()
}

#[test]
fn a_run_of_the_tuned_scene_confirms_the_prediction() {
    let folder = tempfile::tempdir().unwrap();
    let loaded = scene(&[]);
    let (tuning, tuned) = tuned(&loaded, folder.path(), Demand::Error(0.06));
    let picked = tuning.picked.clone().unwrap();
    let promised = picked.error.unwrap();
    assert!(promised + tuning.reference.error <= 0.06 && tuning.reference.error <= 0.006, "{tuning:?}");

    // The search for rest, which this test repeats, is as far from the reference of this test.
    let system = cutis::build_system(&loaded).unwrap().system;
    let [start, fine] = reference(&loaded, 2 * tuning.reference.substeps.last().unwrap());
    let trial = &tuning.rest;
    assert!(trial.stated_error.unwrap() <= loaded.scene.run.error && trial.ms > Some(0.0), "{trial:?}");
    let gravity = cutis::build_system(&loaded).unwrap().settings.gravity_m_s2;
    let rest = cutis::rest::Body::of(&system, gravity).unwrap();
    let rest = rest.settle(&cutis::rest::Options::default(), &mut |_| ()).unwrap().positions;
    let rest = rest.into_iter().zip(system.vertices()).filter(|(_, v)| v.inverse_mass() > 0.0);
    let apart = rms(&rest.map(|(p, _)| p).collect::<Vec<_>>(), &fine) / rms(&fine, &start);
    assert!((trial.difference.unwrap() - apart).abs() < 0.01, "{apart} and {trial:?}");
    assert!(
        apart > 0.0 && trial.wounds[0].difference_mm.abs() < 0.1 * trial.wounds[0].growth_mm,
        "{trial:?}"
    );

    // Only the settings differ.
    let mut expected = loaded.scene.clone();
    expected.solver = tuned.scene.solver.clone();
    assert_eq!(tuned.scene, expected);

    let run = |loaded: &LoadedScene| -> (Report, f64) {
        let mut kept = loaded.clone();
        kept.scene.run.checkpoint_every = 1000;
        let report = run_in(folder.path(), &kept, false).unwrap();
        let end = state(folder.path()).into_iter().zip(system.vertices());
        let end: Vec<_> = end.filter(|(_, v)| v.inverse_mass() > 0.0).map(|(p, _)| p).collect();
        (report, rms(&end, &fine) / rms(&fine, &start))
    };
    let (report, error) = run(&tuned);
    assert!(near(error, promised), "an error of {error} and not {promised}");
    let wound = report.wound.clone().unwrap();
    let growth = wound.final_mm - wound.initial_mm;
    assert!((growth - picked.wounds[0].growth_mm).abs() < 1e-6, "{growth} {picked:?}");
    // Negative control: the original scene does not meet the prediction.
    let (_, before) = run(&loaded);
    assert!(!near(before, promised), "{before} {promised}");

    // The predicted time is that of the trial and of real runs, within the noise of other tests on
    // this machine.
    let promised = picked.ms_per_frame.unwrap();
    let trial = tuning.stages.iter().find(|stage| stage.name == format!("try {}", picked.setting)).unwrap();
    let frames = f64::from(tuning.frames);
    assert!((0.8 * trial.ms..=trial.ms).contains(&(promised * frames)), "{promised} ms of {trial:?}");
    let times: Vec<f64> = (0..5).map(|_| run(&tuned).0.frames.ms_mean).collect();
    let (least, most) = times.iter().fold((f64::MAX, 0.0), |(l, m), &t| (f64::min(l, t), f64::max(m, t)));
    assert!(
        (least / BUSY..=BUSY * most).contains(&promised),
        "{promised} ms were promised, and the runs took {times:?}"
    );
}

#[test]
fn the_budget_is_kept_and_the_front_is_pareto_optimal() {
    let folder = tempfile::tempdir().unwrap();
    let loaded = scene(&[("run.frames", "8")]);
    let (tuning, _) = tuned(&loaded, folder.path(), Demand::Default);
    let own = tuning.candidates.iter().find(|candidate| candidate.own).unwrap();
    let budget = own.ms_per_frame.unwrap();
    assert!(own.error.unwrap() > 0.05, "{own:?}");
    let best = tuning.picked.unwrap();
    assert!(best.error < own.error);
    let mut front: Vec<_> = tuning.candidates.iter().filter(|c| c.pareto).collect();
    front.sort_by(|a, b| a.ms_per_frame.unwrap().total_cmp(&b.ms_per_frame.unwrap()));
    assert!(front.len() > 2 && front.windows(2).all(|pair| pair[0].error > pair[1].error), "{front:?}");

    let other = tempfile::tempdir().unwrap();
    let (tuning, _) = tuned(&loaded, other.path(), Demand::BudgetMs(budget));
    let picked = tuning.picked.unwrap();
    assert!(picked.ms_per_frame.unwrap() <= budget);
    let affordable = tuning.candidates.iter().filter(|c| c.ms_per_frame.is_some_and(|ms| ms <= budget));
    assert!(affordable.filter_map(|c| c.error).all(|error| error >= picked.error.unwrap()));
}

/// The cost report describes a run of the tuned scene, and not one with another formulation.
#[test]
fn the_cost_report_describes_the_picked_setting() {
    let folder = tempfile::tempdir().unwrap();
    let own = [("run.frames", "2"), ("solver.formulation", "\"vbd\""), ("solver.substeps", "4")];
    let loaded = scene(&own);
    let (tuning, tuned) = tuned(&loaded, folder.path(), Demand::Error(0.5));
    let stored = |loaded: &LoadedScene| cutis::check(loaded, &Silent).unwrap().memory;
    let parts = tuning.costs.parts.iter().filter(|part| part.host_bytes > 0);
    let parts: Vec<(&str, usize)> = parts.map(|part| (part.part.as_str(), part.host_bytes)).collect();
    let expected = stored(&tuned);
    assert_eq!(parts, expected.iter().map(|part| (part.part.as_str(), part.bytes)).collect::<Vec<_>>());
    assert!(tuning.costs.ms_per_frame() > Some(0.0));
    let mut other = tuned.clone();
    let solver = &mut other.scene.solver;
    solver.formulation = match solver.formulation {
        Formulation::Vbd => Formulation::Xpbd,
        Formulation::Pbd | Formulation::Xpbd => Formulation::Vbd,
    };
    assert_ne!(expected, stored(&other));
}

#[test]
fn the_ablation_measures_every_optional_part() {
    let folder = tempfile::tempdir().unwrap();
    let outputs = "{ surface = true, volume = true, report = true }";
    let loaded = scene(&[("run.frames", "4"), ("output", outputs)]);
    let options =
        TuneOptions { omissions: true, ..options(folder.path().join("tuned.toml"), Demand::Error(0.5)) };
    let tuning = cutis::tune(&loaded, &options, &Silent).unwrap();
    let find = |what: &str| tuning.omissions.iter().find(|o| o.what.contains(what)).unwrap();
    let stc = find("stc");
    assert!(
        (stc.wounds[0].difference_percent.unwrap() + 100.0).abs() < 1.0,
        "without tension it stays shut: {stc:?}"
    );
    assert!((stc.change.unwrap() - 1.0).abs() < 0.01);
    for kind in ["distance", "volume", "stc"] {
        let part = tuning.costs.parts.iter().find(|part| part.part == kind).unwrap();
        assert!(find(kind).saved_bytes >= part.host_bytes as i64, "{kind}");
        assert!(find(kind).residuals.len() == 2 && find(kind).change > Some(0.0), "{kind}");
    }
    let (fine, coarse) = (find("1.25 x"), find("2 x"));
    assert!(0 < fine.saved_bytes && fine.saved_bytes < coarse.saved_bytes);
    assert!(fine.change.unwrap() < 1.0, "the same body moves much alike on another lattice: {fine:?}");
    let files: Vec<&str> = tuning.omissions.iter().filter_map(|o| o.what.strip_prefix("output.")).collect();
    assert_eq!(files, ["surface", "volume"]);
    assert!(find("output.volume").saved_bytes > 0 && find("output.volume").saved_ms > Some(0.0));
    assert_eq!(scenes::names(folder.path()), ["tuned.toml"], "outputs that were timed are not kept");
}

/// The picked region has the opening of the whole body, a run of the tuned scene has the opening of
/// the trial, and a smaller region opens less.
#[test]
fn the_picked_region_opens_as_far_as_the_whole_body() {
    let folder = tempfile::tempdir().unwrap();
    let loaded = scene(&[]);
    let most = 0.25;
    let out = folder.path().join("tuned.toml");
    let options = TuneOptions { region: true, minutes: 30.0, ..options(out.clone(), Demand::Error(most)) };
    let tuning = cutis::tune(&loaded, &options, &Silent).unwrap();
    let region = tuning.region().expect("a region");
    assert!(region.error <= Some(most) && region.time_share < Some(1.0), "{region:?}");
    assert!(region.saved_bytes > 0 && region.tets_share < Some(0.8), "{region:?}");
    let smaller: Vec<f64> = tuning
        .regions
        .iter()
        .filter(|trial| trial.grading_mm == region.grading_mm && trial.around_mm < region.around_mm)
        .filter_map(|trial| trial.error)
        .collect();
    assert!(smaller.iter().all(|error| *error > most), "{:?}", tuning.regions);

    let tuned = Scene::load(&out, &[]).unwrap();
    assert_eq!(tuned.scene.lattice.region, Some(RegionSection::around(region.around_mm)));
    let growth = |loaded: &LoadedScene| {
        let wound = run_in(folder.path(), loaded, false).unwrap().wound.unwrap();
        wound.final_mm - wound.initial_mm
    };
    let opening = growth(&tuned);
    assert!((opening - region.wounds[0].growth_mm).abs() < 1e-6, "{opening} {region:?}");
    let mut whole = tuned.clone();
    whole.scene.lattice = LatticeSection {
        region: Some(RegionSection::Whole(WholeBody::Whole)),
        ..loaded.scene.lattice.clone()
    };
    let error = (opening / growth(&whole) - 1.0).abs();
    assert!((error - region.error.unwrap()).abs() < 1e-6, "{error} {region:?}");
    // Negative control: half of the region does not pass.
    let mut half = tuned.clone();
    half.scene.lattice.region = Some(RegionSection::around(0.4 * region.around_mm));
    assert!((growth(&half) / growth(&whole) - 1.0).abs() > error);

    // A scene with a region keeps it.
    let own = scene(&[("lattice.region.around_mm", "70"), ("run.frames", "2")]);
    let options = TuneOptions { overwrite: true, ..options };
    let tuning = cutis::tune(&own, &TuneOptions { demand: Demand::Error(0.9), ..options }, &Silent).unwrap();
    assert_eq!(tuning.regions, []);
    assert_eq!(Scene::load(&out, &[]).unwrap().scene.lattice, own.scene.lattice);
}

#[test]
fn scenes_that_cannot_be_tuned_are_refused_early() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("tuned.toml");
    let refused = |set: &[(&str, &str)], demand: Demand, words: &[&str]| {
        let error = cutis::tune(&scene(set), &options(out.clone(), demand), &Silent).unwrap_err();
        assert!(error.is_bad_input(), "{error}");
        words.iter().for_each(|word| assert!(error.to_string().contains(word), "no {word:?} in {error}"));
    };
    refused(&[("solver.formulation", "\"pbd\"")], Demand::Default, &["solver.formulation", "pbd", "xpbd"]);
    refused(&[("run.frames", "0")], Demand::Default, &["run.frames"]);
    refused(&[], Demand::Error(f64::NAN), &["an error of NaN %", "100 %"]);
    refused(&[], Demand::BudgetMs(-1.0), &["a budget of -1 ms"]);
    refused(&[("constraints", "{}"), ("run.frames", "1")], Demand::Default, &["nothing in this scene moves"]);
    std::fs::write(&out, "# mine").unwrap();
    refused(&[], Demand::Default, &["tuned.toml", "--force"]);
    assert_eq!(std::fs::read_to_string(&out).unwrap(), "# mine");
}

#[test]
fn a_target_that_no_setting_meets_is_reported_and_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let loaded = scene(&[("run.frames", "2")]);
    let options = options(folder.path().join("tuned.toml"), Demand::BudgetMs(1e-6));
    let tuning = cutis::tune(&loaded, &options, &Silent).unwrap();
    let error = tuning.unmet().unwrap();
    assert!(matches!(&error, Error::NoSetting { .. }) && !error.is_bad_input(), "{error}");
    assert!(tuning.picked.is_none() && tuning.scene_file.is_none() && !options.out.exists());
    assert!(tuning.candidates.iter().any(|candidate| candidate.own && candidate.error.is_some()));
    assert!(!error.to_string().contains("reached only") && tuning.reference.needs_minutes.is_none());

    // The time limit allows no reference that is finer than the scene.
    let loaded = scene(&[("run.frames", "2"), ("solver.substeps", "400")]);
    let tuning = cutis::tune(&loaded, &TuneOptions { minutes: 1e-6, ..options }, &Silent).unwrap();
    assert_eq!(tuning.reference.substeps, [4, 8, 16]);
    let error = tuning.unmet().unwrap().to_string();
    for words in ["reached only 16 substeps a frame and the scene has 400", "--minutes"] {
        assert!(error.contains(words), "no {words:?} in {error}");
    }
}

#[test]
fn a_time_limit_that_is_too_short_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let loaded = scene(&[("run.frames", "2"), ("solver.substeps", "2")]);
    let options = options(folder.path().join("tuned.toml"), Demand::Default);
    // The time limit only allows the required runs: three levels of the reference and the scene's
    // own setting.
    let hurried = TuneOptions { minutes: 1e-6, omissions: false, ..options };
    let tuning = cutis::tune(&loaded, &hurried, &Silent).unwrap();
    let picked = tuning.picked.as_ref().unwrap();
    assert!(picked.own && picked.error > Some(0.05), "{picked:?}");
    let note = tuning.warnings.iter().find(|line| line.contains("misses the target")).expect("no note");
    let late = tuning.candidates.iter().filter(|candidate| !candidate.own).count();
    let late = format!("{late} settings were not run for lack of time (--minutes)");
    for words in ["needs about ", "substeps a frame for an error of 5 %", &late] {
        assert!(note.contains(words), "no {words:?} in {note}");
    }
}

/// Handles move in the frames, so that there is no state of rest to compare with.
#[test]
fn a_scene_with_handles_is_not_searched_for_rest() {
    let folder = tempfile::tempdir().unwrap();
    let handle = "[{ at_mm = [-40, 100, 0], radius_mm = 15, move_mm = [0, 20, 5] }]";
    let loaded = scene(&[("run.frames", "2"), ("handle", handle)]);
    let options = TuneOptions { minutes: 1e-6, ..options(folder.path().join("tuned.toml"), Demand::Default) };
    let tuning = cutis::tune(&loaded, &options, &Silent).unwrap();
    assert!(tuning.rest.skipped.as_ref().is_some_and(|why| why.contains("handles")), "{:?}", tuning.rest);
    assert_eq!((tuning.rest.ms, tuning.rest.difference), (None, None));
}
