//! Bodies from scans, by way of scene files: a phantom torso and a real abdomen with an incision, and skin that is dragged.

use std::path::PathBuf;

use cutis::{Override, Scene, SceneSystem};
use nalgebra::Point3;

use super::{Case, Failure, Measure};
use crate::origin::scan;

/// The phantom of the demo, cut on the belly, on a lattice of `spacing_mm`.
///
/// # Errors
/// What the pipeline refuses.
pub fn incision(spacing_mm: f64) -> Result<Case, Failure> {
    let what = format!(
        "the demo's phantom on a lattice of {spacing_mm} mm, cut on the belly; skin tension opens the wound"
    );
    of_scene("incision", what, "demo.toml", &[("lattice.spacing_mm", spacing_mm.to_string())])
}

/// The scan of [`abdomen`].
///
/// # Errors
/// That it is absent.
pub fn abdomen_scan() -> Result<PathBuf, Failure> {
    scan("abdomen_ts_122x101x112.nii.gz").map_err(|reason| format!("abdomen: {reason}").into())
}

/// A real abdomen, cut on the belly; none, with a printed reason, where its scan is absent.
///
/// # Errors
/// What the pipeline refuses; an absent scan where `CI` is set.
pub fn abdomen(spacing_mm: f64) -> Result<Option<Case>, Failure> {
    let path = match abdomen_scan() {
        Ok(path) => path,
        Err(reason) if std::env::var_os("CI").is_some() => return Err(reason),
        Err(reason) => {
            eprintln!("skipped: {reason}");
            return Ok(None);
        }
    };
    let what = format!(
        "a real abdomen on a lattice of {spacing_mm} mm, cut on the belly; skin tension opens the wound"
    );
    let set = [("lattice.spacing_mm", spacing_mm.to_string()), ("volume.path", path.display().to_string())];
    of_scene("abdomen", what, "abdomen-incision.toml", &set).map(Some)
}

/// The phantom without an incision; a handle in the middle of the skin of the belly pulls it up and aside.
///
/// # Errors
/// What the pipeline refuses.
pub fn drag(spacing_mm: f64) -> Result<Case, Failure> {
    let handle =
        "[{ at_mm = [0.0, 110.0, 0.0], radius_mm = 22.0, move_mm = [15.0, 25.0, 0.0], over_s = 0.25 }]";
    let what = format!(
        "the demo's phantom on a lattice of {spacing_mm} mm without a cut; a handle drags the skin of the belly by 29 mm \
         within 0.25 s"
    );
    let set = [
        ("lattice.spacing_mm", spacing_mm.to_string()),
        ("incision", "[]".to_owned()),
        ("constraints.stc.rest_area_scale", "1.0".to_owned()),
        ("handle", handle.to_owned()),
    ];
    let mut case = of_scene("drag", what, "demo.toml", &set)?;
    case.instants = vec![4, 10];
    case.compared_at = 12;
    Ok(case)
}

/// Damped so that 120 frames bring the body to rest: less keeps the stiff modes going, more slows the soft ones.
fn of_scene(name: &'static str, what: String, file: &str, set: &[(&str, String)]) -> Result<Case, Failure> {
    let built = |formulation: &str| -> Result<SceneSystem, Failure> {
        let path = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../fixtures/scenes")).join(file);
        let more =
            [("solver.formulation", formulation.to_owned()), ("solver.damping_per_s", "12".to_owned())];
        let overrides: Vec<Override> = set
            .iter()
            .chain(&more)
            .map(|(key, value)| Override { key: (*key).to_owned(), value: value.clone() })
            .collect();
        Ok(cutis::build_system(&Scene::load(&path, &overrides)?)?)
    };
    let SceneSystem { system, settings, gapes } = built("xpbd")?;
    let pbd = built("pbd")?.system;
    let opening = gapes.into_iter().next().map(|gape| -> (Measure, &'static str) {
        let measure = move |x: &[Point3<f64>]| gape.measure_by(&|vertex| x[vertex as usize]).mean_mm;
        (Box::new(measure), "mm")
    });
    Ok(Case {
        name,
        what,
        xpbd: system,
        pbd: Some(pbd),
        settings,
        instants: vec![1, 4],
        compared_at: 5,
        most_frames: 120,
        opening,
    })
}
