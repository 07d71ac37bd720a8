//! Contact of the lips of cuts of no width in scenes: lips that are pressed together do not pass
//! through each other.

use cutis::{LoadedScene, Scene, Silent};
use cutis_test_kit::gpu::on_each_adapter;

use crate::gpu::{agree, run_on};
use crate::scenes::{Run, SMALL, column, frames, overrides, run_in};
use crate::sutures::{CUT, sewn};

/// Lattice step of these scenes, mm.
const STEP: f64 = 7.0;

/// Threads of nine tenths of the length that would close the wound.
const TIGHT: &str =
    "[{ wound = 0, every_mm = 10, bite_mm = 7, at_s = 0.1, tighten_s = 0.2, tighten_to = 0.9 }]";

/// Settings of the three formulations.
fn formulations() -> [[(&'static str, &'static str); 4]; 3] {
    [("pbd", "2", "20"), ("xpbd", "20", "2"), ("vbd", "2", "2")].map(|(formulation, substeps, iterations)| {
        [
            ("solver.formulation", formulation),
            ("solver.substeps", substeps),
            ("solver.iterations", iterations),
            ("constraints.membrane.stiffness", "0.1"),
        ]
    })
}

/// Firm tissue and skin on the staircase of the lattice, which resist the threads.
const FIRM: [(&str, &str); 3] = [
    ("constraints.distance.youngs_modulus_pa", "2e4"),
    ("constraints.volume.bulk_modulus_pa", "1e5"),
    ("skin.smooth", "false"),
];

const OFF: (&str, &str) = ("constraints.contact.acts", "false");

/// Threads that pull more than twice the tension of the wound close it, and its lips overlap by
/// less than 2 % of a lattice step; in PBD, which has no stiffness, by less than 5 %. Control:
/// without contact they pass through each other.
#[test]
fn lips_that_threads_press_together_do_not_pass_through_each_other() {
    for formulation in formulations() {
        let frames = [("run.frames", "80")];
        let run = |more: &[(&str, &str)]| {
            Run::of(&sewn(TIGHT, "around", &[&formulation[..], &FIRM, &frames, more].concat())).report
        };
        let (closed, crossed) = (run(&[]), run(&[OFF]));
        let least = |report: &cutis::report::Report| {
            let wound = report.wound.as_ref().unwrap();
            wound.mid_mm.min(wound.final_mm)
        };
        let bound = if formulation[0].1 == "pbd" { 0.05 } else { 0.02 };
        assert!(least(&closed) > -bound * STEP, "{formulation:?}: {:?}", closed.wound);
        assert!(least(&crossed) < -0.05 * STEP, "{formulation:?}: {:?}", crossed.wound);
        let overlap = closed.residuals.iter().find(|residual| residual.kind == "contact").unwrap();
        assert!(overlap.max > 0.0 && overlap.rms < 0.02, "{formulation:?}: {overlap:?}");
        assert!(closed.sizes.lip_pairs > 100 && crossed.sizes.lip_pairs == 0);
        let warned = |report: &cutis::report::Report| {
            report.warnings.iter().filter(|line| line.contains("the lips of incision[0]")).count()
        };
        assert_eq!((warned(&closed), warned(&crossed)), (0, 1), "{formulation:?}: {:?}", closed.warnings);
    }
}

/// Two handles press a wound shut. They move fixed distances, so that the tissue and the overlap
/// share what they press together. Control: without contact they push its sides into each other.
#[test]
fn lips_that_handles_press_together_do_not_pass_through_each_other() {
    let press = "[{ at_mm = [14, 102, 0], radius_mm = 9, move_mm = [3, 0, 0], over_s = 0.2 }, \
                  { at_mm = [47, 100, 0], radius_mm = 9, move_mm = [-3, 0, 0], over_s = 0.2 }]";
    let middle = |contact: &str| {
        let own = [("handle", press), ("run.frames", "30"), ("constraints.contact", contact)];
        Run::of(&sewn("[]", "around", &own)).report.wound.unwrap().mid_mm
    };
    let (touching, crossed) = (middle("{}"), middle("{ acts = false }"));
    assert!(crossed < -0.1 * STEP && touching > 0.3 * crossed, "{touching} and {crossed}");
}

/// A cut that grows has contact behind its tip, and a run that is interrupted in the middle
/// continues with the same bits. Control: without contact.
#[test]
fn a_growing_cut_has_contact_behind_its_tip() {
    let growing = CUT.replace("depth_mm = 20", "depth_mm = 20, speed_mm_s = 1000.0");
    for formulation in formulations() {
        let scene = |frames: &str, threads: &str, more: &[(&str, &str)]| {
            let suture =
                TIGHT.replace("at_s = 0.1", "at_s = 0.05").replace("tighten_s = 0.2", "tighten_s = 0.1");
            let own = [
                ("incision", growing.as_str()),
                ("run.frames", frames),
                ("run.checkpoint_every", "5"),
                ("solver.threads", threads),
            ];
            sewn(&suture, "around", &[&formulation[..], &own, more].concat())
        };
        let [whole, halves, other] = [(); 3].map(|()| tempfile::tempdir().unwrap());
        let report = run_in(whole.path(), &scene("20", "1", &[]), false).unwrap();
        run_in(halves.path(), &scene("5", "2", &[]), false).unwrap();
        run_in(halves.path(), &scene("20", "3", &[]), true).unwrap();
        let read = |folder: &tempfile::TempDir| std::fs::read(folder.path().join("checkpoint.bin")).unwrap();
        assert!(read(&whole) == read(&halves), "{formulation:?}");
        assert_eq!(frames(whole.path()), frames(halves.path()));
        run_in(other.path(), &scene("20", "1", &[OFF]), false).unwrap();
        assert_ne!(frames(whole.path()), frames(other.path()), "{formulation:?}");
        assert!(report.residuals.iter().any(|residual| residual.kind == "contact" && residual.max > 0.0));
    }
    // Until the cut begins, nothing moves.
    let late = CUT.replace("depth_mm = 20", "depth_mm = 20, at_s = 0.1");
    let scene =
        sewn("[]", "around", &[("incision", &late), ("run.frames", "8"), ("constraints.contact", "{}")]);
    let run = Run::of(&scene);
    let (time, opening) = (column(&run, "time_s"), column(&run, "gape_0_mid_mm"));
    assert!(time.iter().zip(&opening).all(|(time, gape)| (*time <= 0.1) == (*gape == 0.0)), "{opening:?}");
}

/// Both backends press lips alike, in cuts that exist from the start and in cuts that grow.
/// Control: without contact.
#[test]
fn a_gpu_presses_lips_as_the_cpu_does() {
    on_each_adapter(|gpu| {
        for [formulation, substeps, ..] in formulations() {
            for speed in ["", ", speed_mm_s = 2000.0"] {
                let incision = CUT.replace("depth_mm = 20", &format!("depth_mm = 20{speed}"));
                let scene = |more: &[(&str, &str)]| {
                    let suture = "[{ wound = 0, every_mm = 20, bite_mm = 10, at_s = 0.05, tighten_s = 0.02, \
                                   tighten_to = 0.6 }]";
                    let own = [
                        formulation,
                        substeps,
                        ("incision", &incision),
                        ("lattice.spacing_mm", "12"),
                        ("run.frames", "8"),
                        ("run.checkpoint_every", "8"),
                        ("output", "{}"),
                    ];
                    sewn(suture, "around", &[&own, more].concat())
                };
                let [cpu, on_gpu, control] = [(); 3].map(|()| tempfile::tempdir().unwrap());
                run_in(cpu.path(), &scene(&[]), false).unwrap();
                run_on(gpu, on_gpu.path(), &scene(&[]), false).unwrap();
                assert!(agree(gpu, cpu.path(), on_gpu.path()), "{formulation:?}{speed}");
                run_on(gpu, control.path(), &scene(&[OFF]), false).unwrap();
                assert!(!agree(gpu, cpu.path(), control.path()), "{formulation:?}{speed}");
            }
        }
    });
}

fn load(set: &[(&str, &str)]) -> Result<LoadedScene, cutis::Error> {
    Scene::load(&crate::scenes::folder().join(SMALL), &overrides(set))
}

/// Scenes with sutures have contact unless they leave it out. Others have it only if they name it.
#[test]
fn contact_comes_with_sutures() {
    let plan = |suture: &str, more: &[(&str, &str)]| {
        let loaded = sewn(suture, "around", &[&[("lattice.spacing_mm", "12")], more].concat());
        cutis::check(&loaded, &Silent).unwrap()
    };
    let acts = |plan: &cutis::Plan| {
        let stored = plan.memory.iter().any(|part| part.part == "contact");
        let left_out = plan.left_out.iter().any(|line| line.starts_with("contact: left out"));
        assert!(stored == (plan.sizes.lip_pairs > 0) && left_out != stored, "{:?}", plan.left_out);
        stored
    };
    let sutures = "[{ wound = 0, every_mm = 20, bite_mm = 12 }]";
    let with = plan(sutures, &[("solver.formulation", "xpbd")]);
    assert!(acts(&with) && with.colors["contact"] > 0);
    assert!(with.costs.parts.iter().any(|part| part.part == "contact" && part.host_bytes > 0));
    assert!(!acts(&plan(sutures, &[OFF])) && !acts(&plan("[]", &[])));
    assert!(acts(&plan("[]", &[("constraints.contact", "{}")])));
    // Without springs and volumes nothing says how stiff contact is, but for PBD.
    let skin = "{ membrane = { preset = 'trunk' } }";
    let bare = [("constraints", skin), ("incision", CUT), ("suture", sutures)];
    assert_eq!(load(&bare).unwrap().scene.constraints.contact, None);
    assert!(
        load(&[&bare[..], &[("solver.formulation", "pbd")]].concat())
            .unwrap()
            .scene
            .constraints
            .contact
            .is_some()
    );
    let error = load(&[&bare[..], &[("constraints.contact", "{}")]].concat()).unwrap_err().to_string();
    assert!(error.contains("constraints.contact") && error.contains("constraints.volume"), "{error}");
    // A slit with a width has no lips that touch.
    let wide = CUT.replace("depth_mm", "width_mm = 12, depth_mm");
    let idle = plan("[]", &[("incision", &wide), ("constraints.contact", "{}")]);
    assert!(idle.warnings.iter().any(|line| line.contains("constraints.contact has no effect")));
}
