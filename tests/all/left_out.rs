//! Parts that a scene does not name are not stored, computed or written, and the report lists them.

use std::fs;

use cutis::constraints::{Constraint, Distance, SkinTension, Volume};
use cutis::{LoadedScene, Plan, Silent};

use crate::scenes::{Run, SMALL, scene};

fn plan(loaded: &LoadedScene) -> Plan {
    cutis::check(loaded, &Silent).unwrap()
}

/// Bytes of one part of the plan, if the plan has it.
fn bytes(plan: &Plan, part: &str) -> Option<usize> {
    plan.memory.iter().find(|p| p.part == part).map(|p| p.bytes)
}

fn says(lines: &[String], topic: &str) -> bool {
    lines.iter().any(|line| line.starts_with(&format!("{topic}:")))
}

/// Bytes that a kind needs: indices, parameters and compliance of each constraint, and the end of
/// each color.
fn needed<const N: usize, C: Constraint<N>>(count: usize, colors: usize) -> usize {
    count * (N * size_of::<u32>() + size_of::<C::Params<f32>>() + size_of::<f32>())
        + (colors + 1) * size_of::<u32>()
}

#[test]
fn a_kind_needs_only_its_own_bytes() {
    let full = scene(SMALL, &[]);
    let whole = plan(&full);
    let kinds = [
        (
            "distance",
            needed::<2, Distance>(whole.sizes.edges, whole.colors["distance"]),
            2 * whole.sizes.edges,
        ),
        ("volume", needed::<4, Volume>(whole.sizes.tets, whole.colors["volume"]), 4 * whole.sizes.tets),
        (
            "stc",
            needed::<3, SkinTension>(whole.sizes.skin_triangles, whole.colors["stc"]),
            3 * whole.sizes.skin_triangles,
        ),
    ];
    assert!(whole.sizes.skin_triangles > 1000);
    for (kind, expected, corners) in kinds {
        // Up to three runs of a color take 12 bytes each. One of 16 constraints in a row has its
        // vertices, of 4 bytes each, in a list of their own.
        let found = bytes(&whole, kind).unwrap();
        let most = expected + 36 * whole.colors[kind] + 4 * corners / 16;
        assert!((expected..=most).contains(&found), "{kind}: {found}");
        assert!(!says(&whole.left_out, kind), "{kind} is there: {:?}", whole.left_out);

        let mut without = full.clone();
        let constraints = &mut without.scene.constraints;
        match kind {
            "distance" => constraints.distance = None,
            "volume" => constraints.volume = None,
            _ => constraints.stc = None,
        }
        let less = plan(&without);
        assert_eq!(bytes(&less, kind), None);
        assert!(!less.colors.contains_key(kind) && less.colors.len() == 2, "{:?}", less.colors);
        assert!(says(&less.left_out, kind), "{:?}", less.left_out);
        let others: Vec<_> = whole.memory.iter().filter(|part| part.part != kind).cloned().collect();
        assert_eq!(less.memory, others, "leaving {kind} out changes what the others take");
        assert!(less.projections < whole.projections);
    }
}

#[test]
fn without_any_kind_only_the_vertices_are_stored() {
    let plan = plan(&scene(SMALL, &[("constraints", "{}")]));
    let parts: Vec<&str> = plan.memory.iter().map(|part| part.part.as_str()).collect();
    assert_eq!((parts, plan.projections), (vec!["vertices"], 0));
    assert!(plan.warnings.iter().any(|line| line.contains("no constraint kind")), "{:?}", plan.warnings);
}

#[test]
fn a_handle_is_stored_only_if_there_is_one() {
    let handle = "[{ at_mm = [-40, 100, 0], radius_mm = 15, move_mm = [0, 20, 5] }]";
    let with = plan(&scene(SMALL, &[("handle", handle)]));
    assert!(bytes(&with, "handles").is_some_and(|bytes| bytes > 0) && !says(&with.left_out, "handle"));
    let without = plan(&scene(SMALL, &[]));
    assert!(bytes(&without, "handles").is_none() && says(&without.left_out, "handle"));
}

/// The skin is detected only if tension, an incision, a surface or a picture needs it.
#[test]
fn the_skin_is_detected_only_if_needed() {
    let bare = [
        ("constraints", "{ distance = { youngs_modulus_pa = 5e3 } }"),
        ("incision", "[]"),
        ("run.frames", "0"),
    ];
    let run = |set: &[(&str, &str)]| Run::of(&scene(SMALL, &[&bare, set].concat())).report;
    let without = run(&[("output", "{ report = true }")]);
    assert_eq!(without.sizes.skin_triangles, 0);
    assert!(without.skin.is_none() && says(&without.left_out, "skin"), "{:?}", without.left_out);
    let with = run(&[("output", "{ surface = true }")]);
    assert!(with.skin.is_some() && with.sizes.skin_triangles > 0 && !says(&with.left_out, "skin"));
}

/// Without the volume only what the pictures show is resampled, and they stay the same. The CT is
/// larger than that: it has many tiles.
#[test]
fn pictures_without_the_volume_are_those_with_it() {
    let ct = ("volume.phantom", "{ size = [192, 160, 192], seed = 1 }");
    let run = |output: &str| {
        let run = Run::of(&scene(SMALL, &[ct, ("run.frames", "4"), ("output", output)]));
        let pictures = ["before.png", "after.png", "slice.png"].map(|name| fs::read(run.path(name)).unwrap());
        (pictures, run)
    };
    let (with, whole) = run("{ pictures = true, volume = true }");
    let (without, part) = run("{ pictures = true }");
    assert!(with == without, "the pictures differ");
    assert!(with[0] != with[1], "control: the wound moves");
    assert!(whole.report.resample.is_some() && part.report.resample.is_none());
}

#[test]
fn only_named_outputs_are_written() {
    let run = |output: &[(&str, &str)]| Run::of(&scene(SMALL, &[&[("run.frames", "1")], output].concat()));
    let report = ["frames.csv", "report.html", "report.json"];
    let cases: [(&str, &[&str]); 6] = [
        ("{}", &[]),
        ("{ report = true }", &report),
        ("{ volume = true }", &["deformed.nii.gz"]),
        ("{ surface = true }", &["skin.vtu"]),
        ("{ tissue = true }", &["tissue.vtu"]),
        ("{ pictures = true }", &["after.png", "before.png", "slice.png"]),
    ];
    for (output, expected) in cases {
        let run = run(&[("output", output)]);
        assert_eq!(run.names(), expected, "{output}");
        let resampled = output.contains("volume") || output.contains("pictures");
        // The counts are those of the whole volume.
        assert_eq!(run.report.resample.is_some(), output.contains("volume"), "{output}");
        assert_eq!(run.report.stages.iter().any(|stage| stage.name == "resample the CT"), resampled);
        for (topic, key) in
            [("surface", "surface"), ("tissue", "tissue"), ("pictures", "pictures"), ("report", "report")]
        {
            assert_eq!(says(&run.report.left_out, topic), !output.contains(key), "{output}: {topic}");
        }
    }
    // Without an output section everything but the tissue mesh is written.
    let all = [
        "after.png",
        "before.png",
        "deformed.nii.gz",
        "frames.csv",
        "report.html",
        "report.json",
        "skin.vtu",
        "slice.png",
    ];
    assert_eq!(run(&[]).names(), all);
    // Checkpoints are written only on request.
    assert_eq!(run(&[("output", "{}"), ("run.checkpoint_every", "1")]).names(), ["checkpoint.bin"]);
}

/// A search for the state of rest takes no steps. Control: a scene with a frame has all of it.
#[test]
fn a_search_for_rest_prepares_no_frames() {
    let with = |frames: u32| {
        let run = format!("{{ frames = {frames}, until = 'rest' }}");
        plan(&scene(SMALL, &[("solver.formulation", "vbd"), ("run", &run)]))
    };
    let (rest, frame) = (with(0), with(1));
    for part in ["incidences", "teams"] {
        assert_eq!(bytes(&rest, part), None);
        assert!(bytes(&frame, part).is_some_and(|bytes| bytes > 0), "{part}");
    }
    assert!(rest.colors.is_empty() && !frame.colors.is_empty());
    assert_eq!((rest.projections, frame.projections > 0), (0, true));
    assert!(says(&rest.left_out, "groups of colors") && !says(&frame.left_out, "groups of colors"));
    assert_eq!(rest.costs.time, "not measured: the run has no frames");
    assert!(frame.costs.ms_per_frame().is_some());
}
