//! Sutures: threads across an incision close it, hold a force, and let go.

use cutis::{LoadedScene, Scene};
use cutis_test_kit::gpu::on_each_adapter;

use crate::gpu::{agree, run_on};
use crate::scenes::{Run, SMALL, column, frames, overrides, run_in, scene};

pub const CUT: &str = "[{ from_mm = [30.3, 110, -50], to_mm = [30.3, 110, 50], depth_mm = 20 }]";

/// The small phantom at rest with a cut of 100 mm and sutures, given as the value of `suture`.
/// `lines` is the axis of the lines of tension: `around` the trunk, across the cut, or `along` it.
pub fn sewn(suture: &str, lines: &str, set: &[(&str, &str)]) -> LoadedScene {
    let constraints = format!(
        "{{ distance = {{ youngs_modulus_pa = 5e3 }}, volume = {{ bulk_modulus_pa = 2.5e4 }}, membrane = {{ \
         tension_along_n_per_m = 6, tension_across_n_per_m = 2, modulus_along_n_per_m = 60, \
         modulus_across_n_per_m = 60, directions = {{ {lines} = [0, 0, 1] }} }} }}"
    );
    let own = [
        ("scan_is_at_rest", "true"),
        ("lattice.split", "five"),
        ("lattice.spacing_mm", "7"),
        ("lattice.region", "{ around_mm = 50 }"),
        ("constraints", constraints.as_str()),
        ("incision", CUT),
        ("suture", suture),
        ("solver.formulation", "vbd"),
        ("solver.substeps", "2"),
        ("solver.iterations", "2"),
        ("output", "{ report = true }"),
    ];
    scene(SMALL, &[&own[..], set].concat())
}

const STITCHES: &str = "[{ wound = 0, every_mm = 10, bite_mm = 7, at_s = 0.3, tighten_s = 0.3 }]";

/// Threads close the wound and then hold about the tension that the cut set free: 6 N/m over 100
/// mm. Control: without sutures the wound stays open.
#[test]
fn threads_close_the_wound_and_hold_its_tension() {
    let frames = [("run.frames", "120")];
    let open = Run::of(&sewn("[]", "around", &frames)).report.wound.unwrap();
    let run = Run::of(&sewn(STITCHES, "around", &frames));
    let (closed, suture) = (run.report.wound.clone().unwrap(), &run.report.sutures[0]);
    assert!(open.mid_mm > 3.0, "{open:?}");
    assert!(closed.mid_mm < 0.25 * open.mid_mm && closed.mid_mm > -0.1, "{closed:?}, open {open:?}");
    assert_eq!((suture.wound, suture.stitches), (0, 10));
    assert!((0.5 * 0.6..1.1 * 0.6).contains(&suture.force_n), "{suture:?}");
    assert!((suture.force_n_per_cm * 10.0 / suture.force_n - 1.0).abs() < 1e-9, "{suture:?}");
    assert!(suture.largest_n >= suture.force_n / 10.0, "{suture:?}");
    // Before they pull there is no force, and while they are tightened it grows.
    let (time, force) = (column(&run, "time_s"), column(&run, "suture_0_n"));
    assert!(time.iter().zip(&force).all(|(time, force)| *time > 0.3 || *force == 0.0), "{force:?}");
    assert!(force[18..].first() < force.last(), "{force:?}");
    assert!(run.bytes("report.html").windows(20).any(|text| text == b"Force of the sutures"));
}

/// A shorter thread brings the lips closer and pulls harder.
#[test]
fn a_shorter_thread_pulls_harder() {
    let wound = |to: f64| {
        let suture = STITCHES.replace("tighten_s", &format!("tighten_to = {to}, tighten_s"));
        let report = Run::of(&sewn(&suture, "around", &[("run.frames", "90")])).report;
        (report.wound.unwrap().mid_mm, report.sutures[0].force_n)
    };
    let (loose, tight) = (wound(1.0), wound(0.9));
    assert!(tight.0 < loose.0 && tight.1 > loose.1, "{loose:?} {tight:?}");
}

/// A wound across the lines of tension needs more force than one along them.
#[test]
fn closing_across_the_lines_takes_more_force() {
    let force =
        |lines: &str| Run::of(&sewn(STITCHES, lines, &[("run.frames", "90")])).report.sutures[0].force_n;
    let (across, along) = (force("around"), force("along"));
    // The tensions are 6 and 2 N/m.
    assert!((2.0..4.0).contains(&(across / along)), "{across} and {along}");
}

/// A wound whose threads are cut opens again as if there had been none.
#[test]
fn a_wound_opens_again_when_the_threads_are_cut() {
    let suture = STITCHES.replace("at_s = 0.3", "at_s = 0.0, release_s = 0.4");
    let run = Run::of(&sewn(&suture, "around", &[("run.frames", "160")]));
    let open = Run::of(&sewn("[]", "around", &[("run.frames", "160")])).report.wound.unwrap();
    let again = run.report.wound.clone().unwrap();
    assert!((again.mid_mm / open.mid_mm - 1.0).abs() < 0.01, "{again:?} instead of {open:?}");
    assert_eq!(run.report.sutures[0].force_n, 0.0);
    assert!(!run.report.warnings.iter().any(|line| line.contains("suture")), "{:?}", run.report.warnings);
    let late = Run::of(&sewn(STITCHES, "around", &[("run.frames", "30")]));
    assert!(late.report.warnings.iter().any(|line| line.contains("suture[0] is tight at 0.6 s only")));
    let (time, middle) = (column(&run, "time_s"), column(&run, "gape_0_mid_mm"));
    let held = time.iter().zip(&middle).filter(|(time, _)| **time <= 0.4);
    assert!(held.clone().all(|(_, gape)| *gape < 0.5 * open.mid_mm), "{middle:?}");
}

/// A run that is interrupted while threads are tightened continues with the same bits, on any
/// number of threads of the machine, while a cut grows. Control: another stiffness.
#[test]
fn a_run_resumes_while_threads_are_tightened() {
    let growing = CUT.replace("depth_mm = 20", "depth_mm = 20, speed_mm_s = 1500.0");
    for (formulation, substeps) in [("pbd", "1"), ("xpbd", "20"), ("vbd", "2")] {
        let scene = |stiffness: &str, frames: &str, threads: &str| {
            let suture = format!(
                "[{{ wound = 0, every_mm = 20, bite_mm = 8, at_s = 0.05, tighten_s = 0.2, \
                 thread_n_per_m = {stiffness} }}]"
            );
            let own = [
                ("incision", growing.as_str()),
                ("solver.formulation", formulation),
                ("solver.substeps", substeps),
                ("constraints.membrane.stiffness", "0.1"),
                ("run.frames", frames),
                ("run.checkpoint_every", "7"),
                ("solver.threads", threads),
            ];
            sewn(&suture, "around", &own)
        };
        let [whole, halves, other] = [(); 3].map(|()| tempfile::tempdir().unwrap());
        run_in(whole.path(), &scene("1000", "14", "1"), false).unwrap();
        run_in(halves.path(), &scene("1000", "7", "2"), false).unwrap();
        run_in(halves.path(), &scene("1000", "14", "3"), true).unwrap();
        let read = |folder: &tempfile::TempDir| std::fs::read(folder.path().join("checkpoint.bin")).unwrap();
        assert!(read(&whole) == read(&halves), "{formulation}");
        assert_eq!(frames(whole.path()), frames(halves.path()));
        if formulation != "pbd" {
            run_in(other.path(), &scene("500", "14", "1"), false).unwrap();
            assert_ne!(frames(whole.path()), frames(other.path()), "{formulation}");
        }
    }
}

/// Both backends sew alike. Control: another stiffness.
#[test]
fn a_gpu_sews_as_the_cpu_does() {
    on_each_adapter(|gpu| {
        for (formulation, substeps) in [("xpbd", "20"), ("vbd", "2")] {
            let scene = |stiffness: &str| {
                let suture = format!(
                    "[{{ wound = 0, every_mm = 20, bite_mm = 10, at_s = 0.02, tighten_s = 0.05, \
                     thread_n_per_m = {stiffness} }}]"
                );
                let own = [
                    ("lattice.spacing_mm", "12"),
                    ("solver.formulation", formulation),
                    ("solver.substeps", substeps),
                    ("run.frames", "5"),
                    ("run.checkpoint_every", "5"),
                    ("output", "{}"),
                ];
                sewn(&suture, "around", &own)
            };
            let [cpu, on_gpu, control] = [(); 3].map(|()| tempfile::tempdir().unwrap());
            run_in(cpu.path(), &scene("1000"), false).unwrap();
            run_on(gpu, on_gpu.path(), &scene("1000"), false).unwrap();
            assert!(agree(gpu, cpu.path(), on_gpu.path()), "{formulation}");
            run_on(gpu, control.path(), &scene("300"), false).unwrap();
            assert!(!agree(gpu, cpu.path(), control.path()), "{formulation}");
        }
    });
}

#[test]
fn sutures_that_are_not_possible_are_refused() {
    let refused = |incision: &str, suture: &str, words: [&str; 2]| {
        let set = [("incision", incision), ("suture", suture), ("run.frames", "1"), ("output", "{}")];
        let folder = tempfile::tempdir().unwrap();
        let loaded = Scene::load(&crate::scenes::folder().join(SMALL), &overrides(&set));
        let error = loaded.and_then(|loaded| run_in(folder.path(), &loaded, false)).unwrap_err();
        assert!(error.is_bad_input(), "{error}");
        let text = error.to_string();
        assert!(words.iter().all(|word| text.contains(word)), "{suture}: {text}");
    };
    let own = |keys: &str| format!("[{{ wound = 0, every_mm = 10{keys} }}]");
    refused(CUT, "[{ wound = 1, every_mm = 10 }]", ["suture[0].wound", "there are 1"]);
    let wide = CUT.replace("depth_mm", "width_mm = 7, depth_mm");
    refused(&wide, &own(""), ["suture[0].wound", "without width_mm"]);
    refused(CUT, "[{ wound = 0, every_mm = 0 }]", ["suture[0].every_mm", "above 0"]);
    refused(CUT, "[{ wound = 0, every_mm = 1e-6 }]", ["suture[0]", "too many"]);
    refused(CUT, &own(", bite_mm = -1"), ["suture[0].bite_mm", "-1"]);
    refused(CUT, &own(", tighten_to = 1.5"), ["suture[0].tighten_to", "at most 1"]);
    refused(CUT, &own(", at_s = 1.0, release_s = 0.5"), ["suture[0].release_s", "after at_s"]);
    refused(CUT, &own(", depth_mm = -1"), ["suture[0].depth_mm", "-1"]);
    refused(CUT, &own(", depth_mm = 50"), ["suture[0].depth_mm", "less than the depth of the wound"]);
    let pairs = "[{ wound = 0, pairs_mm = [[[0, 102, -5], [0, 102, 5]]], depth_mm = 3 }]";
    refused(CUT, pairs, ["suture[0].depth_mm", "next to pairs_mm"]);
    // No skin lies half a meter from the incision.
    refused(CUT, &own(", bite_mm = 500.0"), ["suture[0]", "has no skin"]);
}
