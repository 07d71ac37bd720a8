//! Skin settings whose effect no number of the report shows directly: values near an incision, and
//! stiffness by HU.

use super::body::{Finished, run};
use super::vtu::Vtu;

/// Overrides for a run without a handle, with one incision along z at x = 20, that writes only the
/// skin.
const COMMON: [(&str, &str); 4] = [
    ("handle", "[]"),
    ("incision", "[{ from_mm = [20, 40, -20], to_mm = [20, 40, 60], depth_mm = 15, width_mm = 8 }]"),
    ("output", "{ surface = true }"),
    ("run.frames", "6"),
];

fn with(set: &[(&str, &str)]) -> Finished {
    run(&[&COMMON, set].concat())
}

/// Mean displacement, in mm, of the skin within 15 mm of the incision's line and beyond 60 mm.
fn near_and_far(run: &Finished) -> [f64; 2] {
    let mesh = Vtu::of_bytes(&run.files["skin.vtu"]);
    let mut found = [(0.0, 0.0); 2];
    for (now, moved) in mesh.points.iter().zip(mesh.vectors("displacement_mm")) {
        // LPS: the incision is at x = −20, y = −40.
        let across = (now[0] - moved[0] + 20.0).hypot(now[1] - moved[1] + 40.0);
        let length = moved.iter().map(|m| m * m).sum::<f64>().sqrt();
        for (n, is_there) in [across < 15.0, across > 60.0].into_iter().enumerate() {
            if is_there {
                found[n] = (found[n].0 + length, found[n].1 + 1.0);
            }
        }
    }
    found.map(|(sum, count)| sum / count)
}

/// Skin is at rest except near the incision, where it is tight. It moves there and hardly
/// elsewhere.
#[test]
fn values_near_an_incision_hold_near_it() {
    let at_rest = ("constraints.stc.rest_area_scale", "1.0");
    let tight = "{ radius_mm = 30.0, rest_area_factor = 0.6 }";
    let [near, far] = near_and_far(&with(&[at_rest, ("constraints.stc.near_incision", tight)]));
    assert!(near > 0.3 && far < 0.25 * near, "{near} mm near the incision, {far} mm far from it");
    let unloaded = near_and_far(&with(&[at_rest]));
    assert!(unloaded[0] < 1e-3 && unloaded[1] < 1e-3, "{unloaded:?}: skin at rest does not move");
    // The factor holds at the segment and fades to 1 at the radius: a wider radius pulls more.
    let wide = "{ radius_mm = 90.0, rest_area_factor = 0.6 }";
    let [_, far_of_wide] = near_and_far(&with(&[at_rest, ("constraints.stc.near_incision", wide)]));
    assert!(far_of_wide > 2.0 * far, "{far_of_wide} mm, and {far} mm with the small radius");
}

/// Softer skin near the incision opens the wound less.
#[test]
fn the_stiffness_near_an_incision_has_an_effect_there() {
    let factor = |factor: &str| {
        let near = format!("{{ radius_mm = 30.0, rest_area_factor = 0.6, stiffness_factor = {factor} }}");
        near_and_far(&with(&[
            ("constraints.stc.rest_area_scale", "1.0"),
            ("constraints.stc.area_modulus_n_per_m", "1.0"),
            ("constraints.stc.near_incision", &near),
        ]))
    };
    let [soft, plain] = [factor("0.1"), factor("1.0")];
    assert!(soft[0] < 0.7 * plain[0], "{soft:?}, {plain:?}");
}

/// The table's factor at the HU of the skin multiplies the modulus.
#[test]
fn stiffness_by_hu_multiplies_the_modulus() {
    let skin = |modulus: &str, table: &str| {
        with(&[("constraints.stc.area_modulus_n_per_m", modulus), ("constraints.stc.stiffness_table", table)])
            .files["skin.vtu"]
            .clone()
    };
    // Tissue has −449 to 150 HU: in this range the table is 2, and outside it rises towards 9.
    let doubled = skin("50.0", "[[-1000, 9.0], [-449, 2.0], [150, 2.0], [1000, 9.0]]");
    assert!(doubled == skin("100.0", "\"uniform\""), "50 N/m times 2 is 100 N/m");
    assert!(doubled != skin("50.0", "\"uniform\""), "the table has an effect");
}
