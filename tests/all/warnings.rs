//! Warnings and early errors. Each is tested with its cause and without it.

use cutis::{Error, Silent};

use crate::scenes::{SMALL, real, scene};

fn warns(set: &[(&str, &str)], words: &str) -> bool {
    let plan = cutis::check(&scene(SMALL, set), &Silent).unwrap();
    plan.warnings.iter().any(|warning| warning.contains(words))
}

#[test]
fn skin_that_is_too_stiff_for_the_substeps_causes_a_warning() {
    let stiff = ("constraints.stc.area_modulus_n_per_m", "1000.0");
    assert!(warns(&[stiff], "stiffer than 10 substeps") && warns(&[stiff], "opens less"));
    assert!(warns(&[stiff, ("scan_is_at_rest", "true")], "opens too far"));
    assert!(!warns(&[stiff, ("solver.substeps", "1000")], "stiffer than"));
    assert!(!warns(&[stiff, ("solver.iterations", "100")], "stiffer than"));
    assert!(!warns(&[("constraints.stc.area_modulus_n_per_m", "1.0")], "stiffer than"));
    assert!(!warns(&[stiff, ("run.until", "rest")], "stiffer than"), "the search needs no substeps");
}

#[test]
fn a_membrane_that_is_too_stiff_for_the_substeps_causes_a_warning() {
    let membrane = ("constraints", "{ membrane = { preset = 'trunk' } }");
    assert!(warns(&[membrane, ("scan_is_at_rest", "true"), ("solver.substeps", "5")], "opens too far"));
    assert!(warns(&[membrane, ("solver.substeps", "5")], "opens less"));
    assert!(!warns(&[membrane, ("solver.substeps", "1000")], "stiffer than"));
    assert!(!warns(&[membrane, ("solver.substeps", "5"), ("solver.formulation", "vbd")], "stiffer than"));
}

#[test]
fn substeps_that_lose_tension_to_rounding_cause_a_warning() {
    let lost = |substeps| warns(&[("solver.substeps", substeps)], "rounding loses about");
    assert!(lost("3000") && !lost("10") && !lost("100"));
    assert!(!warns(&[("solver.substeps", "3000"), ("run.until", "rest")], "rounding loses about"));
}

/// A plate of 18 mm on the belly, which is two lattice steps thick, is thin. Control: one of 60 mm
/// is not.
#[test]
fn tension_on_thin_parts_causes_a_warning() {
    use cutis::volume::{Volume, nifti, phantom::Phantom};
    let ct = Phantom::new([64, 64, 48], 1).unwrap().volume().unwrap();
    let warns = |thickness_mm: f64| {
        let grid = *ct.grid();
        let hu = |n: usize| {
            let mm = grid.mm(grid.point(n));
            let plate = mm.x.abs() < 60.0 && (80.0..190.0).contains(&mm.y) && mm.z.abs() < thickness_mm / 2.0;
            if plate { 40 } else { ct.voxels()[n] }
        };
        let with_plate = Volume::new(grid, (0..grid.len()).map(hu).collect(), 1.0, 0.0).unwrap();
        let here = tempfile::tempdir().unwrap();
        let file = here.path().join("ct.nii");
        nifti::write(&file, &with_plate).unwrap();
        let volume = format!("{{ path = {file:?} }}");
        warns(&[("volume", &volume), ("incision", "[]")], "thinner than 3 lattice steps")
    };
    assert!(warns(18.0) && !warns(60.0));
}

#[test]
fn narrow_slits_and_free_bodies_cause_warnings() {
    assert!(warns(&[("incision[0].width_mm", "2.0")], "incision[0].width_mm = 2"));
    assert!(!warns(&[("incision.0.width_mm", "12.0")], "width_mm"));
    assert!(warns(&[("fixed", "{}")], "nothing is fixed"));
    assert!(!warns(&[], "nothing is fixed"));
}

#[test]
fn values_without_the_usual_effect_cause_notes() {
    for (key, odd, usual) in [
        ("run.frames", "0", "1"),
        ("solver.damping_per_s", "1e40", "10"),
        ("incision.0.depth_mm", "0.8", "10"),
    ] {
        let note = key.replace(".0.", "[0].") + " = ";
        assert!(warns(&[(key, odd)], &note) && !warns(&[(key, usual)], &note), "{key}");
    }
}

/// The small phantom ends at z = 147 mm.
#[test]
fn an_incision_that_leaves_the_scan_causes_a_warning() {
    let cut = |z: &str| format!("[{{ from_mm = [30, 110, {z}], to_mm = [30, 110, 0], depth_mm = 20 }}]");
    assert!(warns(&[("incision", &cut("240"))], "incision[0] has no skin along"));
    assert!(!warns(&[("incision", &cut("90"))], "has no skin along"));
}

#[test]
fn an_override_of_one_output_keeps_the_others() {
    let output = scene(SMALL, &[("output.tissue", "true")]).scene.output;
    assert!(output.tissue && output.report && output.volume && output.surface && output.pictures);
    let only = scene(SMALL, &[("output", "{report = true}")]).scene.output;
    assert!(
        only.report && !only.volume && !only.pictures,
        "the control: a section names all that is written"
    );
}

/// A scene with a membrane whose lines are those of a file.
fn plan_with_strokes(file: &str, text: &str) -> Result<cutis::Plan, Error> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(file);
    std::fs::write(&path, text).unwrap();
    let membrane = format!("{{ preset = 'trunk', directions = {{ strokes = '{}' }} }}", path.display());
    cutis::check(&scene(SMALL, &[("constraints", &format!("{{ membrane = {membrane} }}"))]), &Silent)
}

/// Strokes that are nowhere near the skin are refused with their file, line and distance. The belly
/// of the phantom is at y = 109.
#[test]
fn strokes_far_from_the_skin_are_refused() {
    let on_skin = "0 109 -20\n20 109 -20\n\n0 109 20\n20 109 20\n";
    let plan = plan_with_strokes("lines.txt", on_skin).unwrap();
    assert!(plan.membrane.unwrap().coverage.unwrap() > 0.1);
    let far = plan_with_strokes("lines.txt", &on_skin.replace("109", "309")).unwrap_err().to_string();
    for words in ["constraints.membrane.directions.strokes", "lines.txt, line 1", "mm from the skin"] {
        assert!(far.contains(words), "no {words:?} in {far}");
    }
    let distance = far.split("the stroke is ").nth(1).unwrap().split(' ').next().unwrap();
    let distance: f64 = distance.parse().unwrap();
    assert!((190.0..220.0).contains(&distance), "{far}");
}

#[test]
fn skipped_parts_of_a_file_of_strokes_cause_a_warning() {
    let markups = |kind: &str| {
        let point = |x: i32| format!(r#"{{ "position": [{x}, 109, 0] }}"#);
        let curve = |kind: &str| {
            format!(
                r#"{{ "type": "{kind}", "coordinateSystem": "RAS", "controlPoints": [{}, {}] }}"#,
                point(0),
                point(20)
            )
        };
        format!(r#"{{ "markups": [{}, {}] }}"#, curve("Curve"), curve(kind))
    };
    let warnings = |kind: &str| plan_with_strokes("lines.mrk.json", &markups(kind)).unwrap().warnings;
    let skipped = |line: &&String| line.contains("lines.mrk.json: 1 markups are not strokes");
    let with = warnings("ROI");
    assert_eq!(with.iter().filter(skipped).count(), 1, "{with:?}");
    assert_eq!(warnings("Curve").iter().filter(skipped).count(), 0);
}

#[test]
fn a_sheared_ct_is_refused_before_the_simulation() {
    let Some(path) = real("awkward/sheared_sform_only.nii.gz") else { return };
    let error =
        cutis::check(&scene(SMALL, &[("volume", &format!("{{ path = '{path}' }}"))]), &Silent).unwrap_err();
    assert!(matches!(&error, Error::SceneKey { key, .. } if key == "output.volume"), "{error}");
}
