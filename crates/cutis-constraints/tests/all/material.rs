//! Compliances: their formulas, their independence of the mesh, and the refused values.

use cutis_constraints::{
    MaterialError, SkinStripLaw, SkinStripMaterial, SkinTensionPaperMaterial, distance_compliance,
    lip_contact_compliance, skin_compliance, skin_strip_compliance, volume_compliance,
};
use nalgebra::Point3;

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-14 * b.abs()
}

/// A rod cut into `n` edges in series is as stiff as one edge, because its volume is divided too.
#[test]
fn a_divided_rod_is_as_stiff_as_a_whole_one() {
    let whole = distance_compliance(1.0, 2e4, 1e-2).unwrap();
    assert!(near(whole, 1.0 / (2e4 * 1e-2)));
    for n in [2.0, 10.0, 1000.0] {
        let piece = distance_compliance(1.0 / n, 2e4, 1e-2 / n).unwrap();
        assert!(near(n * piece, whole));
    }
}

/// The same relative change of volume or area costs the same energy per volume or area in any mesh.
#[test]
fn energy_density_does_not_depend_on_the_mesh() {
    let strain = 0.01;
    for size in [1e-9, 1.0, 1e9] {
        let change = strain * size;
        let volume = change * change / (2.0 * volume_compliance(size, 1e5).unwrap());
        assert!(near(volume / size, 0.5 * 1e5 * strain * strain));
        let area = change * change / (2.0 * skin_compliance(size, 50.0).unwrap());
        assert!(near(area / size, 0.5 * 50.0 * strain * strain));
    }
}

/// A pressure makes the same relative overlap in any mesh.
#[test]
fn overlap_under_a_pressure_does_not_depend_on_the_mesh() {
    let (pressure, modulus) = (500.0, 1e5);
    for (area, length) in [(1e-6, 1e-3), (1.6e-5, 4e-3), (1.0, 1.0)] {
        // The gradient of the overlap is 1/L.
        let force = (pressure / modulus) / lip_contact_compliance(area, length, modulus).unwrap() / length;
        assert!((force / area / pressure - 1.0).abs() < 1e-12, "{area} {length}");
    }
    assert_eq!(lip_contact_compliance(1e-6, 1e-3, f64::INFINITY), Ok(0.0));
    assert!(lip_contact_compliance(0.0, 1e-3, 1e5).is_err());
}

#[test]
fn an_infinite_modulus_is_rigid() {
    assert_eq!(distance_compliance(1e-3, f64::INFINITY, 1e-9), Ok(0.0));
    assert_eq!(volume_compliance(1e-9, f64::INFINITY), Ok(0.0));
    assert_eq!(skin_compliance(1e-6, f64::INFINITY), Ok(0.0));
}

#[test]
fn invalid_values_are_refused_by_name() {
    let refused = |result: Result<f64, MaterialError>, name: &str, bad: f64| match result {
        Err(error @ MaterialError::NotPositive { quantity, value, .. }) => {
            assert_eq!(quantity, name);
            assert_eq!(value.to_bits(), bad.to_bits());
            assert!(error.to_string().starts_with(name), "{error}");
        }
        other => panic!("{name} = {bad}: {other:?}"),
    };
    for bad in [0.0, -1.0, f64::NAN, f64::NEG_INFINITY] {
        refused(distance_compliance(bad, 1.0, 1.0), "rest length", bad);
        refused(distance_compliance(1.0, bad, 1.0), "Young's modulus", bad);
        refused(distance_compliance(1.0, 1.0, bad), "edge volume", bad);
        refused(volume_compliance(bad, 1.0), "rest volume", bad);
        refused(volume_compliance(1.0, bad), "bulk modulus", bad);
        refused(skin_compliance(bad, 1.0), "rest area", bad);
        refused(skin_compliance(1.0, bad), "area modulus", bad);
    }
    refused(distance_compliance(f64::INFINITY, 1.0, 1.0), "rest length", f64::INFINITY);
}

#[test]
fn an_overflowing_compliance_is_refused() {
    let error = distance_compliance(1e200, 1e-200, 1.0).unwrap_err();
    assert!(matches!(error, MaterialError::ComplianceOutOfRange { constraint: "distance", .. }));
    assert!(skin_compliance(1e200, 1e-200).is_err());
}

#[test]
fn the_paper_form_refuses_invalid_values() {
    let valid = SkinTensionPaperMaterial::for_stiffness(0.5, 0.8, 1.0).unwrap();
    assert_eq!(valid.max_amplification, 2.0);
    for bad in [0.0, -0.5, f64::NAN, f64::INFINITY] {
        let error = SkinTensionPaperMaterial::for_stiffness(0.5, bad, 1.0).unwrap_err();
        assert!(matches!(error, MaterialError::NotPositive { .. }));
    }
    for bad in [-1e-9, f64::NAN, f64::INFINITY] {
        let error = SkinTensionPaperMaterial::for_stiffness(0.5, 0.9, bad).unwrap_err();
        assert!(matches!(error, MaterialError::Negative { .. }));
    }
    for bad in [0.0, -1.0, 1.1, f64::NAN] {
        let error = SkinTensionPaperMaterial::for_stiffness(bad, 0.9, 1.0).unwrap_err();
        assert!(matches!(error, MaterialError::StiffnessOutOfRange { .. }));
    }
}

const LAW: SkinStripLaw =
    SkinStripLaw { tension_n_per_m: 8.0, modulus_n_per_m: 50.0, stiffening: 2.0, compression: 0.5 };
const UP: [f64; 3] = [0.0, 0.0, 1.0];

#[test]
fn a_strip_refuses_invalid_laws() {
    let refused = |law: SkinStripLaw| SkinStripMaterial::new(UP, [1.0, 0.0, 0.0], law).unwrap_err();
    for bad in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            refused(SkinStripLaw { tension_n_per_m: bad, ..LAW }),
            MaterialError::Negative { .. }
        ));
        assert!(matches!(refused(SkinStripLaw { stiffening: bad, ..LAW }), MaterialError::Negative { .. }));
    }
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = refused(SkinStripLaw { modulus_n_per_m: bad, ..LAW });
        assert!(matches!(error, MaterialError::NotPositive { .. }), "{error}");
    }
    for bad in [-0.1, 1.1, f64::NAN] {
        let error = refused(SkinStripLaw { compression: bad, ..LAW });
        assert!(matches!(error, MaterialError::CompressionOutOfRange { .. }), "{error}");
    }
    let error = refused(SkinStripLaw { tension_n_per_m: 50.0, ..LAW });
    assert!(
        error.to_string().contains("50 N/m") && error.to_string().ends_with("below the modulus"),
        "{error}"
    );
    for tension_n_per_m in [0.0, 49.999] {
        SkinStripLaw { tension_n_per_m, ..LAW }.check().unwrap();
    }
}

#[test]
fn a_strip_refuses_invalid_directions() {
    for bad in [[0.0; 3], [f64::NAN, 0.0, 1.0], [f64::INFINITY, 0.0, 0.0]] {
        for error in [SkinStripMaterial::new(bad, UP, LAW), SkinStripMaterial::new(UP, bad, LAW)] {
            assert!(matches!(error, Err(MaterialError::NotADirection { .. })), "{error:?}");
        }
    }
    let error = SkinStripMaterial::new(UP, [1e-9, 0.0, -2.0], LAW).unwrap_err();
    assert!(matches!(error, MaterialError::AlongNormal { .. }), "{error}");
    for length in [1e-200, 1e200] {
        let strip = SkinStripMaterial::new(UP.map(|v| v * length), [length, 0.0, length], LAW).unwrap();
        assert_eq!(
            (strip.normal().as_slice(), strip.direction().as_slice()),
            (&UP[..], &[1.0, 0.0, 0.0][..])
        );
    }
}

/// Triangles that face inwards or are seen from the edge are errors, with a share that says so.
#[test]
fn a_strip_needs_a_width() {
    let strip = SkinStripMaterial::new(UP, [1.0, 0.0, 0.0], LAW).unwrap();
    let wall = |angle: f64| {
        let (sin, cos) = angle.sin_cos();
        [[0.0, 0.0, 0.0], [cos, sin, 0.0], [0.0, 0.0, 1.0]].map(Point3::from)
    };
    let Err(MaterialError::NoWidth { width }) = strip.compliance(&wall(0.0)) else { panic!() };
    assert_eq!(width, 0.0);
    // Control: a wall that the strip crosses holds it.
    assert!(strip.compliance(&wall(0.1)).is_ok());
    let flat = strip.shape(&[Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(2.0, 0.0, 0.0)]);
    assert!(matches!(flat, Err(MaterialError::NotPositive { .. })));
}

/// Strips that cover the same skin are as stiff together as one.
#[test]
fn strips_side_by_side_are_as_stiff_as_one() {
    let whole = skin_strip_compliance(0.02, 3e-4, 50.0).unwrap();
    assert!(near(whole, 0.02 * 0.02 / (50.0 * 3e-4)));
    let narrow = skin_strip_compliance(0.02, 1e-4, 50.0).unwrap();
    assert!(near(narrow / 3.0, whole));
    assert!(skin_strip_compliance(1e200, 1e-200, 1.0).is_err());
    assert!(skin_strip_compliance(0.0, 1.0, 1.0).is_err());
}
