//! A flat sheet of skin strips is at rest in the scan. A slit or a round hole that is cut into it
//! opens as far as a closed form says.

use cutis_studies::patch::{
    Held, OPENING_TOLERANCE, RATIO_TOLERANCE, Skin, around_hole, controls, error, isotropic, orthotropic,
    round_hole, slit,
};

/// Vertices on the edge of the hole, and distance of the border in half-lengths of the hole.
const AROUND: usize = 72;
const REACH: f64 = 40.0;
const SCAN: Held = Held::Scan(1.0);

fn opening(skin: &Skin, held: Held) -> f64 {
    slit(skin, held, AROUND, REACH).unwrap()
}

fn assert_close(measured: f64, wanted: f64, what: &str) {
    let off = error(measured, wanted);
    assert!(off.abs() <= OPENING_TOLERANCE, "{what}: {measured} m instead of {wanted} m: {off:+.4}");
}

#[test]
fn slits_open_by_the_tension_across_them() {
    let [along, _, across] = [0.0, 45.0, 90.0].map(|angle_deg| {
        let skin = isotropic(angle_deg);
        let opening = opening(&skin, SCAN);
        assert_close(opening, skin.slit_opening(), &format!("lines at {angle_deg}°"));
        opening
    });
    let [n1, n2] = isotropic(0.0).tension;
    let off = error(across / along, n1 / n2);
    assert!(off.abs() <= RATIO_TOLERANCE, "{across} m across the lines, {along} m along them: {off:+.4}");
}

#[test]
fn slits_in_orthotropic_skin_open_by_both_moduli() {
    for angle_deg in [0.0, 90.0] {
        let skin = orthotropic(angle_deg);
        assert_close(opening(&skin, SCAN), skin.slit_opening(), &format!("lines at {angle_deg}°"));
    }
}

/// A border that is held carries a uniform tension. So a sheet without loads opens by as much.
#[test]
fn a_held_border_replaces_the_loads() {
    let skin = isotropic(90.0);
    let [loads, border] = [SCAN, Held::Border].map(|held| opening(&skin, held));
    assert!(error(loads, border).abs() < 2e-3, "{loads} m with loads, {border} m with a held border");
}

#[test]
fn a_round_hole_opens_along_and_across_the_lines() {
    for angle_deg in [0.0, 45.0] {
        let skin = around_hole(angle_deg);
        let measured = round_hole(&skin, SCAN, AROUND, REACH).unwrap();
        for (measured, wanted) in measured.into_iter().zip(skin.hole_displacement()) {
            assert_close(measured, wanted, &format!("lines at {angle_deg}°"));
        }
    }
}

#[test]
fn controls_are_refused() {
    for (what, skin, held, meant) in controls() {
        let off = error(opening(&skin, held), meant.slit_opening());
        assert!(off.abs() > 10.0 * OPENING_TOLERANCE, "{what}: {off:+.4}");
    }
    let turned = round_hole(&around_hole(90.0), SCAN, AROUND, REACH).unwrap();
    let [along, across] = around_hole(0.0).hole_displacement();
    let [x, y] = [error(turned[1], along), error(turned[0], across)];
    assert!(x.abs() > 0.2 && y.abs() > 0.2, "lines turned by 90°: {x:+.3} along, {y:+.3} across");
}
