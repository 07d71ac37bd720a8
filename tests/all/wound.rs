//! Only skin tension opens the wound, and the wound comes to rest.

use cutis::report::Wound;

use crate::scenes::{Run, SMALL, column, real, scene};

/// Mean opening of the wound in each frame, mm.
fn gapes(run: &Run) -> Vec<f64> {
    column(run, "gape_0_mean_mm")
}

/// Largest change over the last ten frames, relative to the final opening.
fn residual_motion(gapes: &[f64]) -> f64 {
    let last = gapes[gapes.len() - 1];
    gapes[gapes.len() - 11..].iter().map(|gape| (gape / last - 1.0).abs()).fold(0.0, f64::max)
}

fn wound(run: &Run) -> &Wound {
    run.report.wound.as_ref().unwrap()
}

const REPORT: (&str, &str) = ("output", "{ report = true }");

#[test]
fn tension_opens_the_wound_which_settles() {
    let run = Run::of(&scene(SMALL, &[REPORT]));
    let (wound, gapes) = (wound(&run), gapes(&run));
    assert!((gapes[0] - wound.initial_mm).abs() < 1e-3 && (gapes[40] - wound.final_mm).abs() < 1e-3);
    assert!(wound.final_mm - wound.initial_mm > 1.0, "{wound:?}");
    assert!(wound.mid_mm - wound.initial_mid_mm > 1.0, "{wound:?}");
    assert!(residual_motion(&gapes) < 0.01, "{gapes:?}");
    // Negative control: the wound is not at rest while it opens.
    assert!(residual_motion(&gapes[..12]) > 0.01, "{gapes:?}");
}

#[test]
fn without_tension_the_wound_stays_as_it_is() {
    let mut without = scene(SMALL, &[REPORT]);
    without.scene.constraints.stc = None;
    for loaded in [without, scene(SMALL, &[REPORT, ("constraints.stc.rest_area_scale", "1.0")])] {
        let run = Run::of(&loaded);
        let wound = wound(&run);
        assert!((wound.final_mm / wound.initial_mm - 1.0).abs() < 0.05, "{wound:?}");
    }
}

/// On a real abdomen the opening agrees with an independent program within 20 % at both
/// stiffnesses.
#[test]
fn the_wound_opens_like_the_reference_in_three_dimensions() {
    let Some(volume) = real("ct/abdomen_ts_64x53x58.nii.gz") else { return };
    let common = [REPORT, ("volume.path", volume.as_str()), ("run.frames", "24")];
    let soft = [
        ("constraints.distance.youngs_modulus_pa", "5e3"),
        ("constraints.volume.bulk_modulus_pa", "5e4"),
        ("constraints.stc.area_modulus_n_per_m", "100"),
        ("constraints.stc.rest_area_scale", "0.8"),
    ];
    let run = |set: &[(&str, &str)]| Run::of(&scene("abdomen-reference.toml", &[&common, set].concat()));
    for (set, expected_mm) in [(&[][..], 2.5), (&soft[..], 9.2)] {
        let run = run(set);
        let wound = wound(&run);
        let opening = wound.final_mm - wound.initial_mm;
        assert!((opening / expected_mm - 1.0).abs() < 0.2, "{opening} mm instead of {expected_mm}");
        assert!(residual_motion(&gapes(&run)) < 0.01);
    }
    let mut without = scene("abdomen-reference.toml", &[&common[..], &[("run.frames", "5")]].concat());
    without.scene.constraints.stc = None;
    let still = Run::of(&without);
    assert!(still.report.max_displacement_mm < 1e-3, "{} mm", still.report.max_displacement_mm);
}
