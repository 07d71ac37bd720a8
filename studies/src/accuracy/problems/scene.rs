//! Problems from scene files: an incision in a phantom torso and in a real abdomen, and dragged
//! skin.

use std::path::PathBuf;

use anyhow::Context;
use cutis::{Override, Scene, SceneSystem};
use nalgebra::Point3;

use super::{Failure, Opening, Problem};
use crate::kit::scene;

/// The phantom of the demo, cut on the belly, on a lattice of `spacing_mm`.
///
/// # Errors
/// The pipeline refuses the scene.
pub fn incision(spacing_mm: f64) -> Result<Problem, Failure> {
    let what = format!(
        "the demo's phantom on a lattice of {spacing_mm} mm, cut on the belly; skin tension opens the wound"
    );
    from_scene("incision", what, "demo-paper", &[("lattice.spacing_mm", spacing_mm.to_string())])
}

/// Path of the scan of [`abdomen`].
///
/// # Errors
/// The scan is missing.
pub fn abdomen_scan() -> Result<PathBuf, Failure> {
    let name = "ct/abdomen_ts_122x101x112.nii.gz";
    cutis_test_kit::scans::find(name)
        .with_context(|| format!("abdomen: {name} is missing (set CUTIS_TEST_DATA)"))
}

/// A real abdomen, cut on the belly. `None` if its scan is missing.
///
/// # Errors
/// The pipeline refuses the scene.
pub fn abdomen(spacing_mm: f64) -> Result<Option<Problem>, Failure> {
    let Ok(path) = abdomen_scan() else { return Ok(None) };
    let what = format!(
        "a real abdomen on a lattice of {spacing_mm} mm, cut on the belly; skin tension opens the wound"
    );
    let set = [("lattice.spacing_mm", spacing_mm.to_string()), ("volume.path", path.display().to_string())];
    from_scene("abdomen", what, "abdomen-paper", &set).map(Some)
}

/// The phantom without an incision. A handle on the skin of the belly pulls it up and to the side.
///
/// # Errors
/// The pipeline refuses the scene.
pub fn drag(spacing_mm: f64) -> Result<Problem, Failure> {
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
    let mut problem = from_scene("drag", what, "demo-paper", &set)?;
    problem.instants = vec![4, 10];
    problem.compared_at = 12;
    Ok(problem)
}

/// A scene with a damping that brings the body to rest in 120 frames. With less damping the stiff
/// modes keep swinging, and with more the soft modes come to rest slowly.
fn from_scene(
    name: &'static str,
    what: String,
    file: &str,
    set: &[(&str, String)],
) -> Result<Problem, Failure> {
    let built = |formulation: &str| -> Result<SceneSystem, Failure> {
        let more =
            [("solver.formulation", formulation.to_owned()), ("solver.damping_per_s", "12".to_owned())];
        let overrides: Vec<Override> = set
            .iter()
            .chain(&more)
            .map(|(key, value)| Override { key: (*key).to_owned(), value: value.clone() })
            .collect();
        Ok(cutis::build_system(&Scene::load(&scene(file), &overrides)?)?)
    };
    let SceneSystem { system, settings, gapes, .. } = built("xpbd")?;
    let pbd = built("pbd")?.system;
    let opening = gapes.into_iter().next().map(|gape| -> (Opening, &'static str) {
        let measure = move |x: &[Point3<f64>]| gape.measure_by(&|vertex| x[vertex as usize]).mean_mm;
        (Box::new(measure), "mm")
    });
    Ok(Problem {
        name,
        what,
        xpbd: system,
        vbd: None,
        pbd: Some(pbd),
        settings,
        instants: vec![1, 4],
        compared_at: 5,
        most_frames: 120,
        opening,
        few_settings: false,
    })
}
