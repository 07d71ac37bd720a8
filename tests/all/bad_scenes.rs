//! Well-formed scenes that do not fit their volume end with a typed error that names the cause, and
//! never with a panic.

use std::path::Path;

use cutis::volume::{Volume, nifti, phantom};
use cutis::{Error, Scene, Silent};

use crate::scenes::{SMALL, folder, overrides, run_in};

/// Runs a scene that must fail, and returns its error. The error must blame the scene.
pub fn refused(set: &[(&str, &str)]) -> Error {
    let loaded = Scene::load(&folder().join(SMALL), &overrides(set));
    let checked = loaded.and_then(|loaded| cutis::check(&loaded, &Silent));
    let Err(error) = checked else { panic!("{set:?} was accepted") };
    assert!(error.is_bad_input(), "{error}");
    error
}

#[test]
fn impossible_scenes_are_refused_with_file_and_section() {
    let cases: [(&str, &str, &[&str]); 22] = [
        (
            "incision",
            "[{ from_mm = [-140, 20, 0], to_mm = [140, 20, 0], depth_mm = 20 }]",
            &["`incision[0]`", "through the body", "mm below the skin", "add points along the skin"],
        ),
        ("volume.offset_hu", "-1024", &["volume.offset_hu", "-1024", "phantom"]),
        (
            "incision",
            "[{ from_mm = [30, 300, 0], to_mm = [30, 300, 50], depth_mm = 20, width_mm = 7 }]",
            &["`incision[0]`", "from the skin", "300.0"],
        ),
        ("incision.0.from_mm", "[1e300, 0, 0]", &["`incision[0]`", "length"]),
        (
            "handle",
            "[{ at_mm = [0, 0, 500], radius_mm = 1, move_mm = [1, 0, 0] }]",
            &["handle[0].at_mm", "500", "no tissue"],
        ),
        ("tissue.air_below_hu", "1e9", &["`tissue.air_below_hu`", "all of the CT air"]),
        ("tissue.density", "unheard-of", &["tissue.density", "unheard-of", "water"]),
        ("tissue.density", "[[0, -5]]", &["tissue.density", "above 0"]),
        ("tissue.density", "[[0, 1], [0, 2]]", &["tissue.density", "increase"]),
        ("tissue.density", "[]", &["tissue.density", "0 points"]),
        ("constraints.stc.stiffness_table", "unheard-of", &["constraints.stc.stiffness_table", "uniform"]),
        ("constraints.stc.stiffness_table", "[[0, 0]]", &["constraints.stc.stiffness_table", "above 0"]),
        ("solver.adapter", " ", &["`solver.adapter`", "cutis devices"]),
        ("lattice.spacing_mm", "1e-9", &["`lattice.spacing_mm`", "or more"]),
        ("lattice.spacing_mm", "1e9", &["`lattice.spacing_mm`", "shortest side"]),
        ("lattice", "{ vertices = [4000000000, 2, 2] }", &["`lattice`", "4000000000"]),
        ("volume.phantom.size", "[0, 8, 8]", &["`volume.phantom`", "[0, 8, 8]"]),
        ("volume.phantom.size", "[5000, 8, 8]", &["`volume.phantom`", "4096"]),
        ("constraints.distance.youngs_modulus_pa", "1e-300", &["`constraints.distance`", "finite"]),
        ("constraints.volume.bulk_modulus_pa", "1e-300", &["`constraints.volume`", "finite"]),
        ("constraints.stc.rest_area_scale", "1e300", &["`constraints.stc`", "rest area"]),
        ("constraints.stc.amplification", "1e300", &["`constraints.stc`", "inf"]),
    ];
    for (key, value, words) in cases {
        let error = refused(&[(key, value)]).to_string();
        assert!(error.contains(SMALL), "{key} = {value}: {error}");
        for word in words {
            assert!(error.contains(word), "{key} = {value}: no {word:?} in: {error}");
        }
    }
}

/// Numbers at the end of their range may end with an error. They never cause a panic or non-finite
/// positions.
#[test]
fn extreme_numbers_end_with_a_result_or_an_error() {
    let extreme = [
        ("constraints.distance.youngs_modulus_pa", "1e300"),
        ("constraints.stc.rest_area_scale", "1e-300"),
        ("solver.dt_s", "1e300"),
        ("solver.dt_s", "1e-300"),
        ("solver.gravity_m_s2", "[1e300, 0, 0]"),
        ("solver.gravity_m_s2", "[1e9, 0, 0]"),
        ("solver.damping_per_s", "1e300"),
        ("incision.0.depth_mm", "1e300"),
        ("incision.0.width_mm", "1e300"),
        ("incision.0.width_mm", "1e-300"),
        ("handle", "[{ at_mm = [30, 100, 0], radius_mm = 20, move_mm = [1e300, 0, 0] }]"),
        ("handle", "[{ at_mm = [30, 100, 0], radius_mm = 1e300, move_mm = [1, 0, 0], over_s = 1e-300 }]"),
        ("fixed.planes", "[{ point_mm = [1e300, 0, 0], normal = [1e-150, 0, 0] }]"),
        ("fixed.bone_above_hu", "-1e9"),
        ("lattice.split", "five"),
        ("skin.mode", "paper"),
    ];
    for (key, value) in extreme {
        let set = [
            ("lattice.spacing_mm", "16"),
            ("run.frames", "2"),
            ("output", "{ surface = true, report = true }"),
            (key, value),
        ];
        let loaded = Scene::load(&folder().join(SMALL), &overrides(&set)).unwrap();
        let out = tempfile::tempdir().unwrap();
        match run_in(out.path(), &loaded, false) {
            Ok(report) => assert!(report.max_displacement_mm.is_finite(), "{key} = {value}"),
            Err(error) => assert!(!error.to_string().is_empty(), "{key} = {value}"),
        }
    }
    // The plan's number of projections does not overflow.
    let huge = [
        ("solver.substeps", "4294967295"),
        ("solver.iterations", "4294967295"),
        ("run.frames", "4294967295"),
    ];
    let loaded = Scene::load(&folder().join(SMALL), &overrides(&huge)).unwrap();
    assert_eq!(cutis::check(&loaded, &Silent).unwrap().projections, u64::MAX);
}

#[test]
fn unusable_volumes_are_named() {
    let here = tempfile::tempdir().unwrap();
    let path = |name: &str| here.path().join(name).to_str().unwrap().to_owned();
    let ball = phantom::sphere([16; 3], [4.0; 3], 20.0, 40).unwrap();
    let air = Volume::new(*ball.grid(), vec![-1000; 16 * 16 * 16], 1.0, 0.0).unwrap();
    nifti::write(path("air.nii.gz"), &air).unwrap();
    nifti::write(path("ball.nii"), &ball).unwrap();
    let bytes = std::fs::read(path("ball.nii")).unwrap();
    std::fs::write(path("half.nii"), &bytes[..bytes.len() / 2]).unwrap();
    std::fs::write(path("text.nii"), "not a volume").unwrap();
    std::fs::write(path("empty.nii.gz"), "").unwrap();
    for (name, word) in [
        ("missing.nii.gz", "missing.nii.gz"),
        ("half.nii", "half.nii"),
        ("text.nii", "text.nii"),
        ("empty.nii.gz", "empty.nii.gz"),
        ("ball.dcm", "ball.dcm"),
        (".", "."),
        ("air.nii.gz", "no tissue"),
    ] {
        let section = format!("{{ path = {:?} }}", path(name));
        let text = refused(&[("volume", &section), ("lattice", "{}")]).to_string();
        assert!(text.contains(word), "{name}: {text}");
    }
}

#[test]
fn unreadable_scene_files_are_named() {
    let here = tempfile::tempdir().unwrap();
    let file = |name: &str, bytes: &[u8]| {
        std::fs::write(here.path().join(name), bytes).unwrap();
        here.path().join(name)
    };
    let long = vec![b'#'; (1 << 20) + 1];
    let cases = [
        (here.path().join("missing.toml"), "cannot read"),
        (here.path().to_owned(), "cannot read"),
        (file("binary.toml", &[0xff, 0xfe, 0x00]), "UTF-8"),
        (file("syntax.toml", b"[volume\npath = 1"), "TOML"),
        (file("twice.toml", b"model = \"pbd\"\nmodel = \"pbd\""), "duplicate"),
        (file("empty.toml", b""), "volume"),
        (file("long.toml", &long), "longer"),
        (file("deep.toml", "[".repeat(100_000).as_bytes()), "TOML"),
        (file("nested.toml", format!("a = {}", "[".repeat(100_000)).as_bytes()), "TOML"),
    ];
    for (path, word) in cases {
        let error = Scene::load(&path, &[]).unwrap_err();
        let text = error.to_string();
        assert!(
            error.is_bad_input() && text.contains(path.to_str().unwrap()) && text.contains(word),
            "{text}"
        );
        assert!(text.len() < 5000, "{} bytes of message", text.len());
    }
    // This file never ends.
    if Path::new("/dev/zero").exists() {
        let text = Scene::load(Path::new("/dev/zero"), &[]).unwrap_err().to_string();
        assert!(text.contains("/dev/zero") && text.contains("longer"), "{text}");
    }
}
