//! Steps: excisions, underminings, hooks and sutures, one after the other.

use std::f64::consts::TAU;

use cutis::{LoadedScene, Scene};
use cutis_test_kit::gpu::on_each_adapter;

use crate::gpu::{agree, run_on};
use crate::identity::original;
use crate::scenes::{Run, SMALL, column, overrides, run_in, scene};

/// An ellipse on the belly with these half axes in mm: to the side, and along the body.
fn ellipse(side: f64, up: f64) -> String {
    let point = |n: usize| {
        let angle = TAU * n as f64 / 20.0;
        let (x, z) = (5.0 + side * angle.cos(), up * angle.sin());
        format!("[{x:.2}, {:.2}, {z:.2}]", 102.5 - x * x / 700.0)
    };
    let points: Vec<String> = (0..20).chain([0]).map(point).collect();
    format!("[{}]", points.join(", "))
}

const LENGTH: f64 = 38.0;
const WIDTH: f64 = 16.0;

fn excise(path: &str, keys: &str) -> String {
    format!("{{ kind = 'excise', name = 'lesion', path_mm = {path}, depth_mm = 16{keys} }}")
}

const UNDERMINE: &str = "{ kind = 'undermine', wound = 'lesion', distance_mm = 22, depth_mm = 9 }";

const SEW: &str =
    "{ kind = 'suture', wound = 'lesion', every_mm = 9, bite_mm = 8, at_s = 0.3, tighten_s = 0.5 }";

/// The small phantom at rest with a list of steps. Lines of tension run around the trunk: 15 N/m
/// along them, 3 N/m across.
fn operated(steps: &[&str], set: &[(&str, &str)]) -> LoadedScene {
    let steps = format!("[{}]", steps.join(", "));
    let constraints = "{ distance = { youngs_modulus_pa = 1e4 }, volume = { bulk_modulus_pa = 1e5 }, membrane = { \
         tension_along_n_per_m = 15, tension_across_n_per_m = 3, modulus_along_n_per_m = 60, \
         modulus_across_n_per_m = 60, directions = { around = [0, 0, 1] } } }";
    let own = [
        ("scan_is_at_rest", "true"),
        ("lattice.split", "five"),
        ("lattice.spacing_mm", "6"),
        ("lattice.region", "{ around_mm = 45 }"),
        ("constraints", constraints),
        ("incision", "[]"),
        ("step", steps.as_str()),
        ("solver.formulation", "vbd"),
        ("solver.substeps", "2"),
        ("solver.iterations", "2"),
        ("run.frames", "90"),
        ("output", "{ report = true }"),
    ];
    scene(SMALL, &[&own[..], set].concat())
}

/// Until the piece is taken out nothing moves. Then the wound opens, and sutures close it with a
/// force that a tension of 3 N/m across 76 mm of wound explains. Control: without sutures it stays
/// open.
#[test]
fn an_excision_is_closed_by_sutures() {
    let lesion = excise(&ellipse(LENGTH, WIDTH), ", at_s = 0.1");
    let run = Run::of(&operated(&[&lesion, SEW], &[]));
    let (time, middle) = (column(&run, "time_s"), column(&run, "gape_0_mid_mm"));
    assert!((middle[0] / (2.0 * WIDTH) - 1.0).abs() < 0.03, "{}", middle[0]);
    // A frame takes 1/60 s.
    let still = time.iter().zip(&middle).filter(|(time, _)| **time <= 0.1 + 1e-9);
    assert!(still.clone().count() > 5 && still.clone().all(|(_, gape)| *gape == middle[0]), "{middle:?}");
    let open = time.iter().zip(&middle).find(|(time, _)| **time > 0.29).unwrap().1;
    assert!(*open > middle[0] + 1.0, "{middle:?}");
    let closed = *middle.last().unwrap();
    assert!(closed.abs() < 0.12 * middle[0], "{closed} of {}", middle[0]);
    let suture = &run.report.sutures[0];
    assert_eq!(suture.stitches, 8);
    // The tension alone, and the elastic skin and fat that are stretched by the width of the piece.
    let tension = 3.0 * 2.0 * LENGTH / 1000.0;
    assert!((tension..20.0 * tension).contains(&suture.force_n), "{suture:?}, tension {tension} N");
    let without = Run::of(&operated(&[&lesion], &[])).report.wound.unwrap();
    assert!(without.mid_mm > 2.0 * WIDTH + 1.0, "{without:?}");
    let sections: Vec<&str> = run.report.steps.iter().map(|step| step.section.as_str()).collect();
    assert_eq!(sections, ["excision[0]", "suture[0]"]);
    assert!(run.report.steps[0].what.contains("76.0 × 31.8 mm"), "{:?}", run.report.steps);
}

/// Undermining makes closing easier, and a wound across the lines of tension is harder to close
/// than one along them.
#[test]
fn undermining_and_the_lines_of_tension_change_the_force() {
    let force = |path: &str, undermined: bool| {
        let lesion = excise(path, "");
        let steps = [lesion.as_str(), UNDERMINE, SEW];
        let steps: Vec<&str> = steps.into_iter().filter(|step| undermined || *step != UNDERMINE).collect();
        let run = Run::of(&operated(&steps, &[]));
        let gape = run.report.wound.unwrap().mid_mm;
        assert!(gape < 0.25 * 2.0 * WIDTH, "{gape}");
        run.report.sutures[0].force_n
    };
    let [along, across] = [ellipse(LENGTH, WIDTH), ellipse(WIDTH, LENGTH)];
    let plain = [force(&along, false), force(&across, false)];
    let free = [force(&along, true), force(&across, true)];
    assert!(plain[1] > 1.1 * plain[0] && free[1] > 1.1 * free[0], "{plain:?} {free:?}");
    assert!(free[0] < 0.92 * plain[0] && free[1] < 0.92 * plain[1], "{plain:?} {free:?}");
}

/// A piece that is taken out of a body that does not move leaves every other voxel as it is.
/// Control: the voxels of the piece are air.
#[test]
fn an_excision_changes_only_the_voxels_of_its_piece() {
    let slack = "{ distance = { youngs_modulus_pa = 1e4 }, volume = { bulk_modulus_pa = 1e5 } }";
    let lesion = excise(&ellipse(LENGTH, WIDTH), ", at_s = 0.02");
    let files = "{ volume = true, report = true }";
    let set = [("run.frames", "4"), ("constraints", slack), ("output", files)];
    let run = Run::of(&operated(&[&lesion], &set));
    assert_eq!(run.report.max_displacement_mm, 0.0);
    let (before, after) = (original(), run.deformed());
    let (grid, spacing) = (before.grid(), before.grid().affine.spacing_mm());
    let voxels = before.voxels().iter().zip(after.voxels()).enumerate();
    let changed: Vec<(usize, i16)> =
        voxels.filter(|(_, (a, b))| a != b).map(|(voxel, (_, &b))| (voxel, b)).collect();
    let air = *before.voxels().iter().min().unwrap();
    for &(voxel, after) in &changed {
        let at = grid.mm(grid.point(voxel));
        let [x, z] = [(at.x - 5.0).abs() - spacing[0], at.z.abs() - spacing[2]].map(|mm| mm.max(0.0));
        assert!((x / LENGTH).powi(2) + (z / WIDTH).powi(2) < 1.0 && after == air, "{after} HU at {at}");
    }
    // Depths are measured from the skin of the lattice, up to a step of 6 mm below the true skin.
    let volume = changed.len() as f64 * spacing.iter().product::<f64>();
    let depth = volume / (TAU / 2.0 * LENGTH * WIDTH);
    assert!((15.0..23.0).contains(&depth), "{depth} mm");
}

/// The picture of the start shows a piece that is taken out later in its place, so it does not
/// depend on the depth. Control: the picture of the end, and a piece that is out from the start.
#[test]
fn a_piece_that_is_taken_out_later_is_in_the_picture_of_the_start() {
    let slack = "{ distance = { youngs_modulus_pa = 1e4 }, volume = { bulk_modulus_pa = 1e5 } }";
    let set = [("run.frames", "4"), ("constraints", slack), ("output", "{ pictures = true }")];
    let run = |at_s: &str, depth: &str| {
        let lesion = excise(&ellipse(LENGTH, WIDTH), at_s).replace("= 16", depth);
        Run::of(&operated(&[&lesion], &set))
    };
    let [later, shallow] = ["= 16", "= 9"].map(|depth| run(", at_s = 0.02", depth));
    assert!(later.bytes("before.png") == shallow.bytes("before.png"));
    assert!(later.bytes("after.png") != shallow.bytes("after.png"));
    let at_start = run("", "= 16");
    assert!(at_start.bytes("before.png") != later.bytes("before.png"));
}

/// A hook holds the skin with a force, which grows while it pulls. Control: it pulls half as far.
#[test]
fn a_hook_pulls_with_a_force() {
    let pull = |move_mm: f64| {
        let hook = format!(
            "{{ kind = 'hook', at_mm = [5, 100, 0], radius_mm = 9, move_mm = [0, {move_mm}, 0], at_s = 0.1, over_s = 0.4 }}"
        );
        Run::of(&operated(&[&hook], &[]))
    };
    let run = pull(8.0);
    let (time, force) = (column(&run, "time_s"), column(&run, "handle_0_n"));
    let before = time.iter().zip(&force).filter(|(time, _)| **time <= 0.1);
    assert!(before.clone().all(|(_, force)| *force < 1e-4), "{force:?}");
    let last = run.report.handles[0].force_n;
    assert!((last - force[force.len() - 1]).abs() < 1e-4 && last > 0.1, "{last} N");
    let half = pull(4.0).report.handles[0].force_n;
    assert!((1.6..2.6).contains(&(last / half)), "{last} and {half} N");
    assert!(run.bytes("report.html").windows(20).any(|text| text == b"Force of the handles"));
}

/// A hook at a lip that has opened: until its time the body moves as without it, then it moves the
/// lip from where it is. Control: a hook that holds the lip from the start.
#[test]
fn a_hook_grabs_tissue_where_it_is() {
    let lesion = excise(&ellipse(LENGTH, WIDTH), "");
    let hook = |at_s: &str| {
        format!(
            "{{ kind = 'hook', at_mm = [5, 102, 19], radius_mm = 8, move_mm = [0, 4, 0], at_s = {at_s}, over_s = 0.1 }}"
        )
    };
    let positions = |steps: &[&str], frames: &str| {
        // A region that does not depend on the hook.
        let region = ("lattice.region", "{ min_mm = [-60, 40, -70], max_mm = [70, 200, 70] }");
        let set = [region, ("run.frames", frames), ("run.checkpoint_every", frames), ("output", "{}")];
        Run::of(&operated(steps, &set)).positions()
    };
    // A frame takes 1/60 s, so the hook acts from the seventh on.
    let (late, early) = (hook("0.09"), hook("0.0"));
    let [free, waiting] = [&[lesion.as_str()][..], &[&lesion, &late]].map(|steps| positions(steps, "6"));
    assert!(free == waiting);
    let [end, held] = [&late, &early].map(|hook| positions(&[&lesion, hook], "20"));
    let exactly_moved = |v: &usize| {
        let by = end[*v] - free[*v];
        by.x.abs() < 1e-7 && (by.y - 0.004).abs() < 1e-7 && by.z.abs() < 1e-7
    };
    let grabbed: Vec<usize> = (0..end.len()).filter(exactly_moved).collect();
    assert!(grabbed.len() > 2, "{grabbed:?}");
    let opened = grabbed.iter().filter(|&&v| (end[v] - held[v]).norm() > 5e-4).count();
    assert!(2 * opened > grabbed.len(), "{opened} of {} vertices opened before", grabbed.len());
}

/// An excision that is as deep as it is wide is planned in a region, because it cuts nothing
/// outside. Control: a region that is smaller than the piece is refused.
#[test]
fn a_large_excision_fits_its_region() {
    let piece = excise(&ellipse(40.0, 40.0), "").replace("depth_mm = 16", "depth_mm = 40");
    let plan = |region: &str| {
        let set = [("lattice.region", region), ("lattice.spacing_mm", "12"), ("output", "{}")];
        cutis::check(&operated(&[&piece], &set), &cutis::Silent)
    };
    plan("{ around_mm = 105 }").unwrap();
    let error = plan("{ min_mm = [-20, 60, -20], max_mm = [30, 200, 20] }").unwrap_err().to_string();
    assert!(error.contains("step[0]") && error.contains("lattice.region"), "{error}");
}

/// A hook lifts undermined skin more easily than skin that adheres, which takes its bed along. Both
/// leave the scan as it is until the hook pulls.
#[test]
fn skin_that_adheres_resists_a_hook() {
    let lift = |adheres: bool| {
        let lesion = excise(&ellipse(LENGTH, WIDTH), "");
        let undermine = UNDERMINE.replace(" }", &format!(", adheres = {adheres} }}"));
        let hook =
            "{ kind = 'hook', at_mm = [5, 102, 22], radius_mm = 8, move_mm = [0, 8, 0], over_s = 0.2 }";
        Run::of(&operated(&[&lesion, &undermine, hook], &[])).report
    };
    let [free, adhering] = [false, true].map(lift);
    let force = |report: &cutis::report::Report| report.handles[0].force_n;
    assert!(force(&adhering) > 1.2 * force(&free), "{} and {}", force(&adhering), force(&free));
    let gap = |report: &cutis::report::Report| {
        report.residuals.iter().find(|residual| residual.kind == "adhesion").map(|residual| residual.max)
    };
    assert_eq!((gap(&free), free.sizes.lip_pairs), (None, 0));
    assert!(adhering.sizes.lip_pairs > 100);
    assert!(gap(&adhering).is_some_and(|gap| gap > 0.0 && gap < 0.05), "{:?}", gap(&adhering));
}

/// A run that is interrupted between the steps continues with the same bits, on any number of
/// threads. Control: another time.
#[test]
fn a_run_resumes_between_steps() {
    let run = |at_s: &str, frames: &str, threads: &str, folder: &std::path::Path, resume: bool| {
        let lesion = excise(&ellipse(LENGTH, WIDTH), &format!(", at_s = {at_s}"));
        let undermine = UNDERMINE.replace(" }", ", at_s = 0.03, speed_mm_s = 300.0, adheres = true }");
        let sew = SEW.replace("0.3", "0.1");
        // It grabs tissue next to the piece in frame 2, before the blade of the undermining is
        // there.
        let hook = "{ kind = 'hook', at_mm = [5, 102, 22], radius_mm = 10, move_mm = [0, 4, 0], at_s = 0.03, over_s = 0.1 }";
        let set = [
            ("lattice.spacing_mm", "9"),
            ("run.frames", frames),
            ("run.checkpoint_every", "5"),
            ("solver.threads", threads),
            ("output", "{ surface = true }"),
        ];
        run_in(folder, &operated(&[&lesion, &undermine, hook, &sew], &set), resume).unwrap();
    };
    let [whole, halves, other] = [(); 3].map(|()| tempfile::tempdir().unwrap());
    run("0.02", "10", "1", whole.path(), false);
    run("0.02", "5", "2", halves.path(), false);
    run("0.02", "10", "3", halves.path(), true);
    let read = |folder: &tempfile::TempDir, file: &str| std::fs::read(folder.path().join(file)).unwrap();
    for file in ["checkpoint.bin", "skin.vtu"] {
        assert!(read(&whole, file) == read(&halves, file), "{file}");
    }
    run("0.0", "10", "1", other.path(), false);
    assert!(read(&whole, "skin.vtu") != read(&other, "skin.vtu"));
}

/// Both backends do the same steps. Controls: another depth, and skin that does not adhere.
#[test]
fn a_gpu_does_the_same_steps() {
    on_each_adapter(|gpu| {
        for formulation in ["xpbd", "vbd"] {
            let scene = |depth: &str, adheres: bool| {
                let lesion = excise(&ellipse(LENGTH, WIDTH), ", at_s = 0.02").replace("16,", depth);
                let undermine = UNDERMINE.replace(" }", &format!(", at_s = 0.03, adheres = {adheres} }}"));
                let sew = SEW.replace("0.3", "0.04");
                let hook = "{ kind = 'hook', at_mm = [5, 102, 22], radius_mm = 10, move_mm = [0, 4, 0], at_s = 0.03, over_s = 0.1 }";
                let set = [
                    ("lattice.spacing_mm", "9"),
                    ("solver.formulation", formulation),
                    ("run.frames", "5"),
                    ("run.checkpoint_every", "5"),
                    ("output", "{}"),
                ];
                operated(&[&lesion, &undermine, hook, &sew], &set)
            };
            let [cpu, on_gpu, control] = [(); 3].map(|()| tempfile::tempdir().unwrap());
            run_in(cpu.path(), &scene("16,", true), false).unwrap();
            run_on(gpu, on_gpu.path(), &scene("16,", true), false).unwrap();
            assert!(agree(gpu, cpu.path(), on_gpu.path()), "{formulation}");
            for (depth, adheres) in [("12,", true), ("16,", false)] {
                run_on(gpu, control.path(), &scene(depth, adheres), false).unwrap();
                assert!(!agree(gpu, cpu.path(), control.path()), "{formulation}");
            }
        }
    });
}

#[test]
fn steps_that_are_not_possible_are_refused() {
    let refused = |steps: &[&str], words: [&str; 2]| {
        let list = format!("[{}]", steps.join(", "));
        let set = [("incision", "[]"), ("step", list.as_str()), ("run.frames", "9"), ("output", "{}")];
        let set = [&set[..], &[("scan_is_at_rest", "true"), ("solver.formulation", "vbd")]].concat();
        let folder = tempfile::tempdir().unwrap();
        let loaded = Scene::load(&crate::scenes::folder().join(SMALL), &overrides(&set));
        let error = loaded.and_then(|loaded| run_in(folder.path(), &loaded, false)).unwrap_err();
        assert!(error.is_bad_input(), "{error}");
        let text = error.to_string();
        assert!(words.iter().all(|word| text.contains(word)), "{steps:?}: {text}");
    };
    let lesion = excise(&ellipse(LENGTH, WIDTH), "");
    refused(&["{ kind = 'slice' }"], ["step[0].kind", "incise, undermine, excise, suture, hook"]);
    refused(&[&lesion, "{ kind = 'excise', depth_mm = 3 }"], ["step[1]", "path_mm"]);
    refused(&[&lesion, &lesion], ["step[1].name", "one wound only"]);
    refused(&[&excise("[[0, 102, 0], [9, 102, 0], [9, 102, 9]]", "")], ["step[0].path_mm", "closed outline"]);
    let eight = "[[-20, 102, -20], [20, 102, 20], [20, 102, -20], [-20, 102, 20], [-20, 102, -20]]";
    refused(&[&excise(eight, "")], ["step[0]", "less than a lattice step"]);
    let far = "[[0, 402, 0], [20, 402, 0], [0, 402, 20], [0, 402, 0]]";
    refused(&[&excise(far, "")], ["step[0]", "from the skin"]);
    refused(&[&lesion, &UNDERMINE.replace("lesion", "other")], ["step[1].wound", "\"other\""]);
    refused(&[&lesion, &UNDERMINE.replace("depth_mm = 9", "depth_mm = 19")], ["step[1].depth_mm", "16 mm"]);
    refused(&[&lesion, &SEW.replace("'lesion'", "1")], ["step[1].wound", "there are 1"]);
    refused(&[SEW, &lesion], ["step[1].at_s", "order of time"]);
    let pairs = |pairs: &str| SEW.replace("every_mm = 9", &format!("pairs_mm = {pairs}"));
    let apart = pairs("[[[60, 97, 0], [75, 94, 0]]]");
    refused(&[&lesion, &apart], ["step[1]", "no cut lies between"]);
    refused(&[&lesion, &pairs("[[[5, 102, 30], [5, 302, -30]]]")], ["step[1]", "no whole skin"]);
    refused(
        &[&lesion, &SEW.replace("every_mm", "pairs_mm = [[[0, 0, 0], [1, 1, 1]]], every_mm")],
        ["step[1].every_mm", "not both"],
    );
}
