//! What the program says without being asked, and refuses before the work: each once with its cause and once without.

use cutis::{Error, Silent};

use crate::scenes::{SMALL, real, scene};

fn warns(set: &[(&str, &str)], words: &str) -> bool {
    let plan = cutis::check(&scene(SMALL, set), &Silent).unwrap();
    plan.warnings.iter().any(|warning| warning.contains(words))
}

#[test]
fn skin_that_the_substeps_cannot_follow() {
    let stiff = ("constraints.stc.area_modulus_n_per_m", "1000.0");
    assert!(warns(&[stiff], "stiffer than 10 substeps"));
    assert!(!warns(&[stiff, ("solver.substeps", "1000")], "stiffer than"));
    assert!(!warns(&[stiff, ("solver.iterations", "100")], "stiffer than"));
    assert!(!warns(&[("constraints.stc.area_modulus_n_per_m", "1.0")], "stiffer than"));
}

#[test]
fn slits_narrower_than_a_step_and_bodies_that_nothing_holds() {
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
    let Some(path) = real("../awkward/sheared_sform_only.nii.gz") else { return };
    let error =
        cutis::check(&scene(SMALL, &[("volume", &format!("{{ path = '{path}' }}"))]), &Silent).unwrap_err();
    assert!(matches!(&error, Error::SceneKey { key, .. } if key == "output.volume"), "{error}");
}
