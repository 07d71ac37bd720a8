//! A random chain scene ends with an error that gives the reason, with all links within their
//! limits, or with a warning.

use cutis::report::Report;
use cutis::{Error, Override, Scene};
use proptest::prelude::*;
use proptest::sample::select;

use super::*;
use crate::scenes::{folder, run_in};

const MATERIALS: [&str; 4] = [
    "\"tissue\"",
    "\"uniform\"",
    "[{ from_hu = -1024, shortest = 1, longest = 1, shear = 0 }]",
    "[{ from_hu = -1024, shortest = [0, 1, 0.9], longest = [16, 1, 1.1], shear = [0, 16, 0.5], k_steps = 0.5 },
      { from_hu = 20, shortest = 0.5, longest = 1.5, shear = 0 }]",
];

/// A point in or near the body, mm.
fn place() -> impl Strategy<Value = [f64; 3]> {
    [-180.0..180.0, -60.0..140.0, -150.0..150.0]
}

fn handle() -> impl Strategy<Value = String> {
    let far = prop_oneof![4 => Just(1.0), 2 => Just(10.0), 1 => Just(1e9)];
    (place(), 5.0..60.0, place(), far, 0.01..1.0).prop_map(|(at, radius, by, far, over_s)| {
        let by = by.map(|mm| 0.2 * mm * far);
        format!("{{ at_mm = {at:?}, radius_mm = {radius}, move_mm = {by:?}, over_s = {over_s} }}")
    })
}

fn incision() -> impl Strategy<Value = String> {
    (-80.0..80.0, -90.0..90.0, -60.0..60.0, 5.0..40.0, 0.0..0.5).prop_map(|(x, z, by, depth, at_s)| {
        format!(
            "{{ from_mm = [{x}, 105, {z}], to_mm = [{}, 105, {}], depth_mm = {depth}, width_mm = 12, at_s = {at_s} }}",
            x + by,
            z + 40.0
        )
    })
}

fn run(handles: &[String], incisions: &[String], materials: &str, relax: u32) -> Result<Report, Error> {
    let set = [
        ("model", "chainmail".to_owned()),
        ("volume", CT_FILE.clone()),
        ("lattice.spacing_mm", "16".into()),
        ("solver", "{ dt_s = 0.125 }".into()),
        ("run.frames", "5".into()),
        ("output", "{ surface = true }".into()),
        ("handle", format!("[{}]", handles.join(", "))),
        ("incision", format!("[{}]", incisions.join(", "))),
        ("chainmail.materials", materials.into()),
        ("chainmail.relax_per_frame", relax.to_string()),
    ];
    let set = set.map(|(key, value)| Override { key: key.into(), value });
    let loaded = Scene::load(&folder().join(SMALL), &set)?;
    run_in(tempfile::tempdir().unwrap().path(), &loaded, false)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_handles_and_incisions_end_well(
        handles in proptest::collection::vec(handle(), 0..3),
        incisions in proptest::collection::vec(incision(), 0..3),
        materials in select(&MATERIALS[..]),
        relax in 0..4_u32,
    ) {
        match run(&handles, &incisions, materials, relax) {
            Err(error) => prop_assert!(error.is_bad_input() && error.to_string().contains(SMALL), "{}", error),
            Ok(report) => {
                let chainmail = report.chainmail.unwrap();
                let warned = report.warnings.iter().any(|line| line.contains("beyond their limits"));
                prop_assert_eq!(warned, chainmail.violated_links > 0);
                prop_assert!(report.max_displacement_mm.is_finite() && chainmail.energy_after.is_finite());
                prop_assert!(chainmail.moved <= report.sizes.vertices);
                prop_assert!((report.max_displacement_mm > 0.0) == (chainmail.moved > 0));
            }
        }
    }
}

/// The generators above produce accepted and refused scenes.
#[test]
fn the_generators_give_accepted_and_refused_scenes() {
    let handle = |by: &str| format!("{{ at_mm = [-40, 100, 0], radius_mm = 20, move_mm = [0, {by}, 0] }}");
    assert!(run(&[handle("8")], &[], MATERIALS[3], 2).is_ok());
    assert!(run(&[handle("1e9")], &[], MATERIALS[0], 2).is_err());
}
