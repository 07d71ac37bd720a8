//! The scan is at rest: an uncut body under full tension does not move, for any formulation and
//! setting, and a cut moves what it sets free.

use std::f32::consts::FRAC_1_SQRT_2;

use cutis::volume::nifti;
use cutis::{LoadedScene, build_system};
use cutis_solver::{Solver, SolverReference};
use cutis_test_kit::gpu::{is_exact, on_each_adapter};
use nalgebra::Vector3;

use crate::gpu::run_on;
use crate::identity::original;
use crate::scenes::{Run, SMALL, scene};

/// Constraints with the skin as a membrane in place of the area form.
const MEMBRANE: (&str, &str) = (
    "constraints",
    "{ distance = { youngs_modulus_pa = 5e3 }, volume = { bulk_modulus_pa = 5e4 }, membrane = { preset = 'trunk' } }",
);
const UNCUT: (&str, &str) = ("incision", "[]");
/// A body this small is faster on one thread.
const ONE_THREAD: (&str, &str) = ("solver.threads", "1");
/// For the tests of all settings, of 200 frames each.
const COARSEST: (&str, &str) = ("lattice.spacing_mm", "36");
const REST: (&str, &str) = ("scan_is_at_rest", "true");
const MOVES: (&str, &str) = ("scan_is_at_rest", "false");

/// The uncut phantom on a coarse lattice.
fn uncut(set: &[(&str, &str)]) -> LoadedScene {
    let coarse = [
        REST,
        ONE_THREAD,
        ("lattice.spacing_mm", "20"),
        UNCUT,
        ("run.frames", "200"),
        ("output", "{ volume = true }"),
    ];
    scene(SMALL, &[&coarse, set].concat())
}

/// Asserts that the run moved no vertex and changed no voxel.
fn assert_still(set: &[(&str, &str)]) {
    let run = Run::of(&uncut(set));
    assert_eq!(run.report.max_displacement_mm, 0.0, "{set:?}");
    assert!(run.deformed().voxels() == original().voxels(), "{set:?}: voxels differ");
}

/// The settings of the three formulations, from the fewest projections to many.
fn settings() -> Vec<[(&'static str, &'static str); 3]> {
    let setting = |formulation, [substeps, iterations]: [&'static str; 2]| {
        [
            ("solver.formulation", formulation),
            ("solver.substeps", substeps),
            ("solver.iterations", iterations),
        ]
    };
    let sizes = [["1", "1"], ["3", "2"], ["20", "4"]];
    let each = |formulation| sizes.map(|size| setting(formulation, size));
    [each("pbd"), each("xpbd"), each("vbd")].concat()
}

#[test]
fn an_uncut_membrane_does_not_move() {
    settings().iter().for_each(|set| assert_still(&[&[COARSEST, MEMBRANE], &set[..]].concat()));
}

#[test]
fn an_uncut_skin_of_the_area_form_does_not_move() {
    settings().iter().for_each(|set| assert_still(&[&[COARSEST], &set[..]].concat()));
    assert_still(&[("solver.formulation", "pbd"), ("constraints.stc.form", "paper")]);
}

/// Control: without the load the same bodies move by tenths of a millimeter or more.
#[test]
fn without_the_load_tension_moves_the_body() {
    for set in settings().iter().filter(|set| set[1].1 == "3") {
        for constraints in [&[][..], &[MEMBRANE]] {
            // PBD knows no modulus: a full projection of every strip would crush the body.
            let soft = ("constraints.membrane.stiffness", "0.1");
            let soft: &[_] = if constraints.is_empty() { &[] } else { &[soft] };
            let all = [constraints, soft, &set[..], &[MOVES, ("run.frames", "10")]].concat();
            let moved = Run::of(&uncut(&all)).report.max_displacement_mm;
            assert!(moved > 0.1, "{all:?}: {moved} mm");
        }
    }
}

#[test]
fn an_uncut_body_does_not_move_in_a_region_or_on_a_graded_lattice() {
    let zone = "{ min_mm = [-40, 40, -60], max_mm = [90, 200, 60] }";
    for key in ["lattice.region", "lattice.grading"] {
        for formulation in ["xpbd", "vbd"] {
            assert_still(&[MEMBRANE, (key, zone), ("solver.formulation", formulation)]);
        }
    }
}

#[test]
fn an_uncut_body_does_not_move_on_a_gpu() {
    on_each_adapter(|gpu| {
        let most = if is_exact(gpu) { 0.0 } else { 1e-3 };
        let still = |set: &[(&str, &str)]| {
            let folder = tempfile::tempdir().unwrap();
            let moved = run_on(gpu, folder.path(), &uncut(set), false).unwrap().max_displacement_mm;
            assert!(moved <= most, "{set:?}: {moved} mm");
            let deformed = nifti::read(folder.path().join("deformed.nii.gz")).unwrap().volume;
            assert!(most > 0.0 || deformed.voxels() == original().voxels(), "{set:?}: voxels differ");
        };
        settings().iter().for_each(|set| still(&[&[COARSEST, MEMBRANE], &set[..]].concat()));
        for set in settings().iter().filter(|set| set[1].1 == "3") {
            still(&[&set[..], &[("run.frames", "20")]].concat());
        }
    });
}

/// The bodies of single precision, stepped in double precision. Their rest lengths and areas are
/// rounded to single precision, which is all that moves them: by less than the rounding of the size
/// of the body, 400 mm. In PBD no modulus weighs these errors against each other, and the body
/// comes to rest a little farther away, in the same place for all settings. Control: without the
/// load.
#[test]
fn an_uncut_membrane_does_not_move_in_double_precision() {
    let moved_mm = |set: &[(&str, &str)], frames: usize| {
        let built = build_system(&uncut(&[&[COARSEST, MEMBRANE], set].concat())).unwrap();
        let rest = built.system.to_f64().positions();
        let mut solver = SolverReference::new(built.system.to_f64(), built.settings).unwrap();
        solver.step(frames).unwrap();
        let moved = solver.positions().unwrap();
        rest.iter().zip(&moved).map(|(a, b)| 1e3 * (a - b).norm()).fold(0.0, f64::max)
    };
    for set in settings() {
        let moved = moved_mm(&set, 200);
        let most = if set[0].1 == "pbd" { 5e-3 } else { 400.0 * f64::from(f32::EPSILON) };
        assert!(moved < most, "{set:?}: {moved} mm");
    }
    for set in settings().iter().filter(|set| set[1].1 == "3") {
        let soft = ("constraints.membrane.stiffness", "0.1");
        let moved = moved_mm(&[&set[..], &[MOVES, soft]].concat(), 10);
        assert!(moved > 0.1, "{set:?}: {moved} mm");
    }
}

/// The load also balances the weight. Without it the body sags.
#[test]
fn weight_moves_nothing_in_a_scan_at_rest() {
    let weight = ("solver.gravity_m_s2", "[0, -9.81, 0]");
    assert_still(&[weight]);
    let sagged = Run::of(&uncut(&[weight, MOVES, ("run.frames", "10")])).report.max_displacement_mm;
    assert!(sagged > 0.1, "{sagged} mm");
}

/// In a scan at rest a cut opens, and the tissue far from it stays. Without the load the whole body
/// shrinks.
#[test]
fn a_cut_moves_only_what_it_sets_free() {
    let run = |set: &[(&str, &str)]| {
        let staircase = ("skin.smooth", "false");
        let own =
            [REST, MEMBRANE, staircase, ("output", "{ report = true }"), ("run.checkpoint_every", "40")];
        Run::of(&scene(SMALL, &[&own, set].concat()))
    };
    // Median displacement of the vertices more than 120 mm from the middle of the cut, in mm. The
    // skin around the trunk passes the motion of the lips on, so the largest one is no measure.
    let far = |run: &Run, rest: &Run| {
        let center = nalgebra::Point3::new(0.03, 0.11, 0.0);
        let pairs = rest.positions().into_iter().zip(run.positions());
        let far = pairs.filter(|(rest, _)| (rest - center).norm() > 0.12);
        let mut moved: Vec<f32> = far.map(|(rest, now)| (now - rest).norm() * 1e3).collect();
        moved.sort_by(f32::total_cmp);
        moved[moved.len() / 2]
    };
    let start = run(&[("constraints", "{}"), ("run.checkpoint_every", "1"), ("run.frames", "1")]);
    let firm = [
        ("solver.formulation", "vbd"),
        ("constraints.distance.youngs_modulus_pa", "5e4"),
        ("constraints.volume.bulk_modulus_pa", "5e5"),
    ];
    let at_rest = run(&firm);
    let free = run(&[&firm[..], &[MOVES]].concat());
    let opening = |run: &Run| {
        let wound = run.report.wound.as_ref().unwrap();
        wound.final_mm - wound.initial_mm
    };
    assert!(opening(&at_rest) > 3.0, "{} mm", opening(&at_rest));
    let [still, moved] = [&at_rest, &free].map(|run| far(run, &start));
    assert!(still < 0.1 * moved && moved > 0.05, "{still} mm with the load, {moved} mm without");
}

/// Strips pull in the plane of the skin, although the facets of the lattice are not parallel to it.
/// Control: the area form pulls in the planes of the facets.
#[test]
fn a_cut_sets_no_force_along_the_normal_free() {
    let normal = Vector3::new(-FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0);
    // The force in the skin and along its normal that a cut of 100 mm sets free, in N.
    let freed = |constraints: &str| {
        let set = [
            REST,
            ("volume.phantom", "{ size = [64, 64, 48], seed = 1, turn_deg = [0, 0, 45] }"),
            ("lattice.split", "five"),
            ("constraints", constraints),
            ("fixed", "{ bone_above_hu = 250.0 }"),
            (
                "incision",
                "[{ from_mm = [-56.6, 99, -50], to_mm = [-56.6, 99, 50], depth_mm = 20, width_mm = 7 }]",
            ),
            ("solver.formulation", "vbd"),
        ];
        let system = build_system(&scene(SMALL, &set)).unwrap().system;
        let forces = system.constraint_forces().unwrap();
        let mut sums = [0.0; 2];
        for (vertex, (force, load)) in system.vertices().iter().zip(forces.iter().zip(system.loads())) {
            let freed = if vertex.inverse_mass() > 0.0 { force + load } else { Vector3::zeros() };
            sums[0] += (freed - normal * normal.dot(&freed)).norm();
            sums[1] += normal.dot(&freed).abs();
        }
        sums
    };
    let tissue = "distance = { youngs_modulus_pa = 5e3 }, volume = { bulk_modulus_pa = 5e4 }";
    let membrane = freed(&format!("{{ {tissue}, membrane = {{ preset = 'trunk' }} }}"));
    let area = freed(&format!(
        "{{ {tissue}, stc = {{ area_modulus_n_per_m = 100.0, amplification = 2.0, rest_area_scale = 0.8 }} }}"
    ));
    assert!(membrane[0] > 2.0 && membrane[1] < 0.1 * membrane[0], "{membrane:?} N");
    assert!(area[1] > 0.3 * area[0], "{area:?} N");
}

/// The template and the demo leave the key out.
#[test]
fn a_scan_is_at_rest_unless_the_scene_says_otherwise() {
    assert!(cutis::demo(&[]).unwrap().scene.scan_is_at_rest);
    assert!(!scene(SMALL, &[]).scene.scan_is_at_rest);
}
