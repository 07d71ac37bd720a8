//! The same cut on the phantom, turned in the scanner, sets the tension of a membrane free.

use cutis_studies::patch::{Patient, TurnedSkin};

/// The load across the cut and along the normal of the skin, in N/m, and whether the first one is
/// the tension.
fn load(skin: TurnedSkin, turn_deg: [f64; 3]) -> ([f64; 2], bool) {
    let smooth = skin != TurnedSkin::Area;
    let load = Patient { smooth, ..Patient::new(skin, turn_deg) }.load().unwrap();
    (load, Patient::has_right_load(load[0]))
}

#[test]
fn a_cut_sets_the_tension_of_a_membrane_free_for_any_turn() {
    for turn_deg in [[45.0, 0.0, 0.0], [0.0, 30.0, 0.0], [0.0, 0.0, 15.0]] {
        let ([across, normal], is_right) = load(TurnedSkin::Membrane, turn_deg);
        assert!(is_right, "{turn_deg:?}: {across} N/m across the cut");
        assert!(normal < 0.05 * across, "{turn_deg:?}: {normal} N/m along the normal");
    }
}

/// Controls: the grain of the area form, and lines that are turned by 90°.
#[test]
fn wrong_skins_have_another_load() {
    let ([across, normal], is_right) = load(TurnedSkin::Area, [45.0, 0.0, 0.0]);
    assert!(!is_right && normal > 0.05 * across, "area form: {across} and {normal} N/m");
    let ([across, _], is_right) = load(TurnedSkin::OtherLines, [0.0; 3]);
    assert!(!is_right, "lines turned by 90°: {across} N/m");
}
