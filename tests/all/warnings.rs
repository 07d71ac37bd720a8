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
    assert!(warns(&[stiff], "stiffer than 10 substeps"));
    assert!(!warns(&[stiff, ("solver.substeps", "1000")], "stiffer than"));
    assert!(!warns(&[stiff, ("solver.iterations", "100")], "stiffer than"));
    assert!(!warns(&[("constraints.stc.area_modulus_n_per_m", "1.0")], "stiffer than"));
}

#[test]
fn narrow_slits_and_free_bodies_cause_warnings() {
    assert!(warns(&[("incision[0].width_mm", "2.0")], "incision[0].width_mm = 2"));
    assert!(!warns(&[("incision.0.width_mm", "12.0")], "width_mm"));
    assert!(warns(&[("fixed", "{}")], "nothing is fixed"));
    assert!(!warns(&[], "nothing is fixed"));
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

#[test]
fn a_sheared_ct_is_refused_before_the_simulation() {
    let Some(path) = real("awkward/sheared_sform_only.nii.gz") else { return };
    let error =
        cutis::check(&scene(SMALL, &[("volume", &format!("{{ path = '{path}' }}"))]), &Silent).unwrap_err();
    assert!(matches!(&error, Error::SceneKey { key, .. } if key == "output.volume"), "{error}");
}
