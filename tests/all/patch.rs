//! Skin tension on the staircase of a plane, for random planes through a lattice: strips have the
//! tension and the modulus of a membrane in the plane.

use cutis_studies::patch::{Form, Measured, Patch, PlaneSkin, Spread, Staircase, TOLERANCE, skins};
use nalgebra::Vector3;

const PLANES: usize = 50;

#[test]
fn strips_have_no_grain() {
    let skins = skins(PLANES).unwrap();
    for form in Form::ALL {
        let found = Measured::of(form, &skins).unwrap();
        let Measured { worst, modulus, .. } = found;
        let is_exact =
            worst <= TOLERANCE && modulus.most - 1.0 <= TOLERANCE && 1.0 - modulus.low <= TOLERANCE;
        // All other forms are controls.
        assert_eq!(is_exact, matches!(form, Form::Strips | Form::ProjectedArea), "{found:?}");
    }
    let projected = skins.iter().map(|skin| Staircase::of(skin).projected);
    let Spread { low, most, .. } = Spread::of(projected).unwrap();
    assert!(low > 1.0 - TOLERANCE && most < 1.0 + TOLERANCE, "the staircase covers the plane: {low} {most}");
}

/// On this plane every triangle has the same slope, in the same direction. An area form has twice
/// as much tension across the slope as along it, for any weights of the triangles.
#[test]
fn no_weight_frees_the_area_form_of_the_grain() {
    let skin = PlaneSkin::new(Vector3::new(1.0, 1.0, 0.0).normalize(), Vector3::z(), 0.2).unwrap();
    for form in [Form::Area, Form::AreaBySight, Form::AreaByMean] {
        let ratio = Patch::of(form, &skin).ratio();
        assert!((ratio - 2.0).abs() < 1e-9, "{ratio}");
    }
    let strips = Patch::of(Form::Strips, &skin).ratio();
    assert!((strips - 1.0).abs() < TOLERANCE, "{strips}");
}
