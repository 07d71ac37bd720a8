//! Scenes of the outer ring.

use std::f64::consts::TAU;

use cutis::scene::{HandleSection, OutputSection, StcForm};
use cutis::solver::Formulation;
use cutis::{LoadedScene, Override, Scene};

use crate::kit::scene;
use crate::parity::bench::{Effort, Failure};

/// A named scene.
pub struct SceneCase {
    pub name: String,
    pub loaded: LoadedScene,
}

impl SceneCase {
    /// A scene with this number of frames. The only output is the deformed volume, if `volume`.
    fn new(name: &str, mut loaded: LoadedScene, frames: u32, volume: bool) -> Self {
        loaded.scene.run.frames = frames;
        loaded.scene.run.checkpoint_every = frames;
        loaded.scene.output = OutputSection { volume, ..OutputSection::NONE };
        Self { name: name.into(), loaded }
    }
}

/// The demo with few voxels and vertices.
pub fn coarse_demo(effort: Effort) -> Result<LoadedScene, Failure> {
    let [phantom, spacing] = coarse_size(effort);
    Ok(cutis::demo(&set(&[("volume.phantom", &phantom), ("lattice.spacing_mm", &spacing)]))?)
}

/// The phantom of coarse scenes and the spacing of their lattices in mm.
fn coarse_size(effort: Effort) -> [String; 2] {
    let quick = effort == Effort::Quick;
    let (size, spacing) = if quick { ("[64, 64, 48]", "12.0") } else { ("[96, 96, 64]", "8.0") };
    [format!("{{ size = {size}, seed = 1 }}"), spacing.into()]
}

/// The demo, an abdomen, a handle, and every kind of constraint alone and all together.
pub fn all(effort: Effort) -> Result<Vec<SceneCase>, Failure> {
    let quick = effort == Effort::Quick;
    let frames = if quick { 2 } else { 5 };
    let [phantom, spacing] = coarse_size(effort);
    let coarse = [
        ("volume.phantom", phantom.as_str()),
        ("lattice.spacing_mm", spacing.as_str()),
        ("solver.formulation", "xpbd"),
        ("solver.substeps", "5"),
        ("solver.iterations", "1"),
    ];
    let mut cases = vec![
        SceneCase::new("demo, coarse", cutis::demo(&set(&coarse))?, frames, true),
        SceneCase::new("demo, coarse, PBD", pbd(cutis::demo(&set(&coarse))?), frames, false),
        SceneCase::new("demo, coarse, VBD", vbd(cutis::demo(&set(&coarse))?), frames, false),
        SceneCase::new("demo, coarse, 3 iterations", iterated(cutis::demo(&set(&coarse))?), frames, false),
        SceneCase::new("demo of the paper, coarse", fixture("demo-paper", &coarse)?, frames, true),
        abdomen(quick, frames)?,
        handle(frames)?,
    ];
    if effort == Effort::Full {
        cases.push(SceneCase::new("demo as it is", cutis::demo(&[])?, 40, true));
    }
    cases.extend(kinds(frames)?);
    cases.extend(steps()?);
    Ok(cases)
}

/// A piece that is excised, undermining that grows, a hook and sutures with contact, in each
/// formulation.
fn steps() -> Result<Vec<SceneCase>, Failure> {
    let outline: Vec<String> = (0..=20)
        .map(|n| {
            let angle = TAU * f64::from(n % 20) / 20.0;
            let (x, z) = (5.0 + 38.0 * angle.cos(), 16.0 * angle.sin());
            format!("[{x:.2}, {:.2}, {z:.2}]", 102.5 - x * x / 700.0)
        })
        .collect();
    let steps = format!(
        "[{{ kind = 'excise', name = 'lesion', path_mm = [{}], depth_mm = 16 }},
          {{ kind = 'undermine', wound = 'lesion', distance_mm = 22, depth_mm = 9, at_s = 0.01,
             speed_mm_s = 300.0 }},
          {{ kind = 'hook', at_mm = [5, 102, 22], radius_mm = 10, move_mm = [0, 4, 0], at_s = 0.02,
             over_s = 0.1 }},
          {{ kind = 'suture', wound = 'lesion', every_mm = 9, bite_mm = 8, at_s = 0.04,
             tighten_s = 0.02 }}]",
        outline.join(", ")
    );
    let mut cases = Vec::new();
    for (formula, formulation) in [("XPBD", "xpbd"), ("PBD", "pbd"), ("VBD", "vbd")] {
        let overrides = [
            ("scan_is_at_rest", "true"),
            ("lattice.split", "five"),
            ("lattice.spacing_mm", "9"),
            ("lattice.region", "{ around_mm = 45 }"),
            ("constraints.membrane", "{ preset = 'trunk' }"),
            ("incision", "[]"),
            ("step", steps.as_str()),
            ("solver.formulation", formulation),
            ("solver.substeps", "2"),
            ("solver.iterations", "2"),
        ];
        let mut loaded = fixture("phantom-small", &overrides)?;
        loaded.scene.constraints.stc = None;
        cases.push(SceneCase::new(&format!("steps of a surgeon, {formula}"), loaded, 6, false));
    }
    Ok(cases)
}

/// The cut abdomen of a CT, or of the phantom if the CT is missing.
fn abdomen(quick: bool, frames: u32) -> Result<SceneCase, Failure> {
    let ct = cutis_test_kit::scans::folder().join("ct/abdomen_ts_122x101x112.nii.gz");
    if !ct.is_file() {
        let loaded = fixture("phantom-small", &[])?;
        return Ok(SceneCase::new("abdomen (phantom: no CT at hand)", loaded, frames, true));
    }
    let path = ct.to_string_lossy();
    let spacing = if quick { "15.0" } else { "9.0" };
    let overrides =
        [("volume.path", path.as_ref()), ("lattice.spacing_mm", spacing), ("solver.substeps", "5")];
    Ok(SceneCase::new("abdomen of a CT, cut", fixture("abdomen-incision", &overrides)?, frames, true))
}

/// Skin next to the incision is dragged up and to the side.
fn handle(frames: u32) -> Result<SceneCase, Failure> {
    let mut loaded = fixture("phantom-small", SMALL)?;
    let (at_mm, move_mm) = ([-30.0, 105.0, 0.0], [0.0, 15.0, 5.0]);
    loaded.scene.handle.push(HandleSection {
        at_mm: Some(at_mm),
        radius_mm: 30.0,
        move_mm: Some(move_mm),
        markups: None,
        at_s: 0.0,
        over_s: 0.05,
    });
    Ok(SceneCase::new("dragged handle", loaded, frames, false))
}

/// A body of a few hundred vertices.
const SMALL: &[(&str, &str)] = &[
    ("volume.phantom", "{ size = [48, 48, 32], seed = 1 }"),
    ("lattice.spacing_mm", "16.0"),
    ("solver.substeps", "4"),
    ("solver.gravity_m_s2", "[0.7, -9.81, 1.3]"),
];

/// Each kind of constraint alone and all together, in all formulations. Gravity loads them.
fn kinds(frames: u32) -> Result<Vec<SceneCase>, Failure> {
    let mut cases = Vec::new();
    for (formula, formulation) in
        [("XPBD", Formulation::Xpbd), ("PBD", Formulation::Pbd), ("VBD", Formulation::Vbd)]
    {
        for (kind, kept) in [
            ("distance", [true, false, false]),
            ("volume", [false, true, false]),
            ("skin tension", [false, false, true]),
            ("all kinds", [true; 3]),
        ] {
            let mut loaded = fixture("phantom-small", SMALL)?;
            loaded.scene.solver.formulation = formulation;
            let constraints = &mut loaded.scene.constraints;
            constraints.distance = constraints.distance.take().filter(|_| kept[0]);
            constraints.volume = constraints.volume.take().filter(|_| kept[1]);
            constraints.stc = constraints.stc.take().filter(|_| kept[2]);
            cases.push(SceneCase::new(&format!("{kind}, {formula}"), loaded, frames, false));
        }
        for (state, at_rest) in [("at rest", "true"), ("free", "false")] {
            let membrane =
                [("constraints", "{ membrane = { preset = 'trunk' } }"), ("scan_is_at_rest", at_rest)];
            let mut loaded = fixture("phantom-small", &[SMALL, &membrane].concat())?;
            loaded.scene.solver.formulation = formulation;
            cases.push(SceneCase::new(&format!("membrane, {state}, {formula}"), loaded, frames, false));
        }
    }
    let mut loaded = pbd(fixture("phantom-small", SMALL)?);
    if let Some(stc) = &mut loaded.scene.constraints.stc {
        (stc.form, stc.stiffness) = (StcForm::Paper, 0.5);
    }
    (loaded.scene.constraints.distance, loaded.scene.constraints.volume) = (None, None);
    cases.push(SceneCase::new("skin tension of the paper, PBD", loaded, frames, false));
    Ok(cases)
}

fn pbd(mut loaded: LoadedScene) -> LoadedScene {
    loaded.scene.solver.formulation = Formulation::Pbd;
    loaded
}

fn vbd(mut loaded: LoadedScene) -> LoadedScene {
    loaded.scene.solver.formulation = Formulation::Vbd;
    (loaded.scene.solver.iterations, loaded.scene.solver.relaxation) = (2, 1.3);
    loaded
}

fn iterated(mut loaded: LoadedScene) -> LoadedScene {
    (loaded.scene.solver.substeps, loaded.scene.solver.iterations) = (2, 3);
    loaded
}

fn fixture(name: &str, overrides: &[(&str, &str)]) -> Result<LoadedScene, Failure> {
    Ok(Scene::load(&scene(name), &set(overrides))?)
}

fn set(overrides: &[(&str, &str)]) -> Vec<Override> {
    overrides.iter().map(|&(key, value)| Override { key: key.into(), value: value.into() }).collect()
}
