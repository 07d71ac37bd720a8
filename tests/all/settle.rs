//! Runs that end in the state of rest.

use cutis::report::MemoryPart;
use cutis::rest::{Body, Options};
use cutis::{Error, Plan, Scene, Silent};
use cutis_newton::{Problem, relative_rms};

use crate::identity::original;
use crate::scenes::{Run, SMALL, folder, overrides, run_in, scene};

const TISSUE: &str = "{ distance = { youngs_modulus_pa = 2e4 }, volume = { bulk_modulus_pa = 1e5 }, \
     membrane = { preset = 'trunk' }, contact = {} }";
const CUT: &str = "[{ from_mm = [30.3, 110, -50], to_mm = [30.3, 110, 50], depth_mm = 20 }]";
const REST: (&str, &str) = ("run", "{ frames = 0, until = 'rest' }");

fn small(set: &[(&str, &str)]) -> cutis::LoadedScene {
    let own = [
        ("scan_is_at_rest", "true"),
        ("constraints", TISSUE),
        ("incision", CUT),
        ("solver.formulation", "vbd"),
        ("output", "{ report = true }"),
    ];
    scene(SMALL, &[&own[..], set].concat())
}

/// The state of rest is that of a direct solver. Control: with another tension it is not.
#[test]
fn a_wound_rests_where_a_direct_solver_finds_it() {
    let system = |constraints: &str| {
        let set = [("lattice.region", "{ around_mm = 45 }"), ("constraints", constraints)];
        cutis::build_system(&small(&set)).unwrap().system
    };
    let [system, other] = [system(TISSUE), system(&TISSUE.replace("trunk", "limb"))];
    let start = system.to_f64().positions();
    let problem = Problem::of(&system, [0.0; 3]).unwrap();
    let expected = problem.equilibrium(&start, &cutis_newton::Options::default()).unwrap();
    let error = |system| {
        let body = Body::of(system, [0.0; 3]).unwrap();
        let options = Options { error: 1e-9, force: 1e-12, ..Options::default() };
        let found = body.settle(&options, &mut |_| ()).unwrap();
        relative_rms(&found.positions, &expected.positions, &start)
    };
    let [same, other] = [&system, &other].map(error);
    assert!(same < 1e-6 && other > 0.01, "{same:e} and {other:e}");
}

/// A plan counts the memory of the search. Control: without one it has no such part.
#[test]
fn a_plan_counts_the_memory_of_the_search() {
    let plan = |set: &[(&str, &str)]| cutis::check(&small(set), &Silent).unwrap();
    let of_search = |plan: &Plan| -> Vec<usize> {
        plan.memory.iter().filter(|part| part.part == MemoryPart::REST).map(|part| part.bytes).collect()
    };
    let (frames, rest) = (plan(&[("run.frames", "1")]), plan(&[REST]));
    let free = rest.sizes.vertices - rest.sizes.fixed_vertices;
    assert_eq!(of_search(&rest), [free * Body::SEARCH_BYTES_PER_VERTEX]);
    assert!(of_search(&frames).is_empty() && rest.device_memory.is_empty(), "control");
    let listed = rest.costs.parts.iter().find(|part| part.part == MemoryPart::REST);
    assert_eq!(listed.map(|part| part.host_bytes), of_search(&rest).first().copied());
}

/// A wound settles to the same opening from the start and after some frames, and a long run ends
/// there. Control: after one short frame it is elsewhere.
#[test]
fn every_way_to_rest_ends_there() {
    let opening = |set: &[(&str, &str)]| {
        let own = [("solver.substeps", "2"), ("solver.iterations", "8")];
        Run::of(&small(&[&own[..], set].concat())).report.wound.unwrap().final_mm
    };
    let settled = opening(&[REST]);
    let after = opening(&[("run", "{ frames = 20, until = 'rest' }")]);
    assert!((settled / after - 1.0).abs() < 2e-3, "{settled} and {after} mm");
    let long = opening(&[("run.frames", "150")]);
    assert!((settled / long - 1.0).abs() < 0.005, "{settled} and {long} mm after a long run");
    let once = [("run.frames", "1"), ("solver.substeps", "1"), ("solver.iterations", "1")];
    let short = opening(&once);
    assert!((settled / short - 1.0).abs() > 0.05, "{settled} and {short} mm after a frame");
}

/// The report states the error and the steps, and the lips of the cut move no more.
#[test]
fn the_report_states_the_error() {
    let run = Run::of(&small(&[REST]));
    let rest = run.report.rest.clone().unwrap();
    assert!(rest.error > 0.0 && rest.error <= 1e-3 && !rest.steps.is_empty(), "{rest:?}");
    assert_eq!(rest.steps.last().unwrap().error, Some(rest.error));
    let html = String::from_utf8(run.bytes("report.html")).unwrap();
    assert!(
        html.contains("The body is <b>at rest</b>, with an estimated error of")
            && html.contains("Search for the state of rest")
    );
    assert!(Run::of(&small(&[("run.frames", "2")])).report.rest.is_none());
}

/// A search ends at the error that the scene allows, near the exact state.
#[test]
fn a_larger_error_ends_earlier() {
    let with = |error: &str| {
        let run = Run::of(&small(&[("run", &format!("{{ frames = 0, until = 'rest', error = {error} }}"))]));
        let opening = run.report.wound.as_ref().unwrap().final_mm;
        (run.report.rest.unwrap(), opening)
    };
    let ((rough, rough_mm), (fine, fine_mm)) = (with("0.05"), with("1e-3"));
    assert!(rough.error <= 0.05 && fine.error <= 1e-3, "{rough:?} and {fine:?}");
    assert!(rough.steps.len() < fine.steps.len(), "{} and {} steps", rough.steps.len(), fine.steps.len());
    assert!((rough_mm / fine_mm - 1.0).abs() < 0.05, "{rough_mm} and {fine_mm} mm");
    for error in ["0.0", "1.1", "nan"] {
        let wrong = Scene::load(&folder().join(SMALL), &overrides(&[("run.error", error)])).unwrap_err();
        assert!(matches!(&wrong, Error::SceneKey { key, .. } if key == "run.error"), "{wrong}");
    }
}

/// A body that is at rest in the scan does not move by one bit, on any lattice.
#[test]
fn an_uncut_body_does_not_move() {
    for lattice in [("lattice.split", "kuhn6"), ("lattice.split", "five")] {
        let run = Run::of(&small(&[
            REST,
            lattice,
            ("incision", "[]"),
            ("output", "{ volume = true, report = true }"),
        ]));
        assert_eq!(run.report.max_displacement_mm, 0.0, "{:?}", run.report.rest);
        assert!(run.deformed().voxels() == original().voxels());
    }
}

#[test]
fn threads_do_not_change_the_state_of_rest() {
    let on = |threads: &str| {
        let run = Run::of(&small(&[REST, ("solver.threads", threads), ("output", "{ surface = true }")]));
        run.bytes("skin.vtu")
    };
    let one = on("1");
    for threads in ["2", "3", "8"] {
        assert!(on(threads) == one, "{threads} threads");
    }
}

/// Sutures pull in the frames. The closed wound settles where a longer run ends. Control: without
/// them it stays open.
#[test]
fn a_sutured_wound_settles_closed() {
    let sew = "[{ wound = 0, every_mm = 10, bite_mm = 10, at_s = 0.1, tighten_s = 0.3 }]";
    let report = |set: &[(&str, &str)]| {
        let own = [("suture", sew), ("solver.substeps", "2"), ("solver.iterations", "8")];
        Run::of(&small(&[&own[..], set].concat())).report
    };
    let settled = report(&[("run", "{ frames = 30, until = 'rest' }")]);
    let long = report(&[("run.frames", "150")]);
    let open = report(&[REST, ("suture", "[]")]);
    let [settled_mm, long_mm, open_mm] =
        [&settled, &long, &open].map(|report| report.wound.as_ref().unwrap().final_mm);
    assert!((settled_mm - long_mm).abs() < 0.01 * open_mm, "{settled_mm} and {long_mm} of {open_mm} mm");
    assert!(settled_mm < 0.5 * open_mm, "{settled_mm} of {open_mm} mm");
    let [force, expected] = [&settled, &long].map(|report| report.sutures[0].force_n);
    assert!((force / expected - 1.0).abs() < 0.02, "{force} and {expected} N");
}

/// A wound is cut, a hook pulls on its lip, and sutures close it. The body settles after each of
/// them. Each state is that in which frames with the same steps come to rest. The steps are far
/// apart, so that the hook grabs tissue that is at rest in the frames too.
#[test]
fn what_is_done_later_settles_one_after_the_other() {
    let hook = "[{ at_mm = [46, 92, 0], radius_mm = 14, move_mm = [20, 8, 0], at_s = 1.5, over_s = 0.2 }]";
    let sew = "[{ wound = 0, every_mm = 10, bite_mm = 10, at_s = 2.0, tighten_s = 0.3 }]";
    let report = |set: &[(&str, &str)]| {
        let cut = CUT.replace("depth_mm", "at_s = 0.1, depth_mm");
        let own = [("incision", &*cut), ("solver.substeps", "2"), ("solver.iterations", "8")];
        Run::of(&small(&[&own[..], &[("handle", hook)], set].concat())).report
    };
    let settled = report(&[REST, ("suture", sew)]);
    let done: Vec<String> = settled.stops.iter().map(|stop| stop.done.concat()).collect();
    assert_eq!(done, ["", "incision[0]", "handle[0]", "suture[0]"]);
    assert_eq!(settled.stops[0].steps, 0, "the scan is at rest");
    let [_, cut_mm, pulled_mm, closed_mm] = [0, 1, 2, 3].map(|n| settled.stops[n].mid_mm[0]);
    assert!((pulled_mm - cut_mm).abs() > 0.1 * cut_mm, "the hook does nothing: {pulled_mm} mm");
    assert!((closed_mm - pulled_mm).abs() > 0.1 * cut_mm, "the sutures do nothing: {closed_mm} mm");
    let long = ("run", "{ frames = 140, until = 'rest' }");
    let [pulled, closed] = [report(&[long]), report(&[long, ("suture", sew)])];
    for (found_mm, expected) in [(pulled_mm, &pulled), (closed_mm, &closed)] {
        let expected_mm = expected.wound.as_ref().unwrap().mid_mm;
        assert!((found_mm - expected_mm).abs() < 0.01 * cut_mm, "{found_mm} and {expected_mm} mm");
    }
    let [force, expected] = [settled.stops[2].handles_n[0], pulled.handles[0].force_n];
    assert!((force / expected - 1.0).abs() < 0.01, "{force} and {expected} N");
    assert_eq!(settled.rest.unwrap().ms, settled.stops[3].ms);
}

/// Ends a run after so many states of rest.
struct StopAfter(u64, std::sync::atomic::AtomicU64);

impl cutis::Progress for StopAfter {
    fn begin(&self, _: &str, _: u64) {
        self.advance(0);
    }
    fn advance(&self, done: u64) {
        self.1.store(done, std::sync::atomic::Ordering::Relaxed);
    }
    fn end(&self) {}
    fn note(&self, _: &str) {}
    fn is_stopped(&self) -> bool {
        self.1.load(std::sync::atomic::Ordering::Relaxed) >= 100 * self.0
    }
}

/// A run that is ended between two states of rest and resumed has the bits of one that is not, and
/// its checkpoint is resampled as the run resampled the scan.
#[test]
fn a_search_that_is_resumed_ends_in_the_same_state() {
    let run = |frames: u32| {
        let cut = CUT.replace("depth_mm", "at_s = 0.1, speed_mm_s = 500, depth_mm");
        let hook =
            "[{ at_mm = [46, 92, 0], radius_mm = 14, move_mm = [20, 8, 0], at_s = 1.5, over_s = 0.2 }]";
        let sew = "[{ wound = 0, every_mm = 10, bite_mm = 10, at_s = 2.0, tighten_s = 0.3 }]";
        let run = format!("{{ frames = {frames}, until = 'rest', checkpoint_every = 1 }}");
        let output = "{ volume = true, surface = true, report = true, series_every = 1 }";
        small(&[("incision", &cut), ("handle", hook), ("suture", sew), ("run", &run), ("output", output)])
    };
    let [whole, parts] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let read = |folder: &std::path::Path, file: &str| std::fs::read(folder.join(file)).unwrap();
    let same = |file: &str| read(whole.path(), file) == read(parts.path(), file);
    let expected = run_in(whole.path(), &run(2), false).unwrap();
    assert_eq!(expected.stops.len(), 4);
    let options = cutis::RunOptions { out: parts.path().into(), resume: false };
    for states in 1..4 {
        let resumed = cutis::RunOptions { resume: states > 1, ..options.clone() };
        let error = cutis::run(&run(2), &resumed, &StopAfter(1, 0.into())).unwrap_err();
        assert!(matches!(error, Error::Interrupted { .. }), "{error:?}");
        assert!(!same("checkpoint.bin"), "after {states}");
    }
    let mut found = run_in(parts.path(), &run(2), true).unwrap();
    let files = ["checkpoint.bin", "skin.vtu", "deformed.nii.gz", "skin-series/skin-rest-000002.vtp"];
    for file in files {
        assert!(same(file), "{file} differs");
    }
    assert_eq!(found.stops[3].ms, found.rest.as_ref().unwrap().ms);
    let without_times = |report: &mut cutis::report::Report| {
        report.stops.iter_mut().for_each(|stop| stop.ms = 0.0);
        format!("{:?}", report.stops)
    };
    let mut expected = expected;
    assert_eq!(without_times(&mut found), without_times(&mut expected));

    // At the end nothing is left to do. The forces are measured again.
    let mut again = run_in(parts.path(), &run(2), true).unwrap();
    let measured = |report: &cutis::report::Report| format!("{:?} {:?}", report.sutures, report.handles);
    assert_eq!(measured(&again), measured(&expected));
    assert_eq!(without_times(&mut again), without_times(&mut expected));
    for file in files {
        assert!(same(file), "{file} differs");
    }
    let error = run_in(parts.path(), &run(3), true).unwrap_err();
    assert!(error.is_bad_input() && error.to_string().contains("after 2 frames"), "{error}");

    let (out, input) = (parts.path().join("again.nii.gz"), cutis::ResampleInput::Volume(None));
    let request = cutis::ResampleRequest { run: parts.path().into(), input, out };
    cutis::resample_run(&run(2), &request, &Silent).unwrap();
    assert!(read(parts.path(), "again.nii.gz") == read(whole.path(), "deformed.nii.gz"));
}

#[test]
fn models_without_energies_are_refused() {
    for (name, set) in
        [("demo-paper.toml", ("solver.formulation", "pbd")), ("demo-chainmail.toml", ("model", "chainmail"))]
    {
        let set = overrides(&[("run.until", "rest"), set]);
        let error = Scene::load(&folder().join(name), &set).unwrap_err();
        assert!(matches!(&error, Error::SceneKey { key, .. } if key == "run.until"), "{error}");
        assert!(error.is_bad_input());
    }
    let wrong = Scene::load(&folder().join(SMALL), &overrides(&[("run.until", "sleep")])).unwrap_err();
    assert!(wrong.to_string().contains("frames") && wrong.to_string().contains("rest"), "{wrong}");
}

/// Tissue that nothing holds has no state of rest under its weight.
#[test]
fn a_body_that_falls_is_an_error() {
    let set = [
        ("scan_is_at_rest", "false"),
        ("fixed", "{}"),
        ("solver.gravity_m_s2", "[0, 0, -9.81]"),
        ("incision", "[]"),
        // Small, because the search makes all its steps.
        ("lattice.spacing_mm", "20"),
        REST,
    ];
    let temporary = tempfile::tempdir().unwrap();
    let error = run_in(temporary.path(), &small(&set), false).unwrap_err();
    assert!(error.to_string().contains("not at rest") && !error.is_bad_input(), "{error}");
}
