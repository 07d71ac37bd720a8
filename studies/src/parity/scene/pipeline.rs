//! A run of the whole pipeline on both backends: positions, velocities, openings of the wounds,
//! deformed volume.

use anyhow::{Context, anyhow, bail};
use cutis::scene::BackendChoice;
use cutis::volume::{Volume, nifti};
use cutis::{LoadedScene, RunFolder, RunOptions, Silent};
use cutis_gpu::Gpu;

use super::cases::SceneCase;
use super::checkpoint::State;
use crate::parity::bench::{Bench, Failure};
use crate::parity::comparison::{Figures, Measured, Ring};
use crate::parity::difference::{Difference, Policy};

/// Largest share of voxels whose value may differ by more than 1, if a device resamples in single
/// precision and the CPU in double. These voxels are at faces that two tets share. Measured: 3e-5.
const SHARE: f64 = 3e-4;

/// The compared results of a run.
struct RunResult {
    state: State,
    openings_mm: Vec<f32>,
    substep_s: f64,
    volume: Option<Volume>,
    /// True if the CPU resampled the volume, in double precision.
    resampled_on_cpu: bool,
}

/// Compares the state, and the deformed volume if the scene has one, with their controls.
pub fn compare(bench: &mut Bench<'_, '_>, case: &SceneCase) -> Result<(), Failure> {
    let name = format!("{}: state and openings", case.name);
    let mut on_cpu = case.loaded.clone();
    on_cpu.scene.solver.backend = BackendChoice::Cpu;
    let expected = ran(&on_cpu, None);
    let mut found = None;
    bench.compare(Ring::Scene, &name, |gpu, policy| {
        let expected = expected.as_ref().map_err(|error| anyhow!("on the CPU: {error}"))?;
        Ok(state(found.insert(ran(&case.loaded, Some(gpu))?), expected, policy))
    })?;
    let Ok(expected) = &expected else { return Ok(()) };

    // Controls run without the volume, which is compared below.
    let mut otherwise_loaded = case.loaded.clone();
    otherwise_loaded.scene.output.volume = false;
    let mut stiffer = otherwise_loaded.clone();
    let scene = &mut otherwise_loaded.scene;
    // Gravity moves nothing in a scan at rest.
    let other_load = if std::mem::take(&mut scene.scan_is_at_rest) {
        "a scan that is not at rest"
    } else {
        scene.solver.gravity_m_s2.iter_mut().for_each(|g| *g += 0.01);
        "gravity off by 0.01 m/s²"
    };
    let constraints = &mut stiffer.scene.constraints;
    if let Some(distance) = &mut constraints.distance {
        distance.youngs_modulus_pa = distance.youngs_modulus_pa.map(|pa| 1.1 * pa);
        distance.stiffness *= 0.99;
    }
    if let Some(volume) = &mut constraints.volume {
        volume.bulk_modulus_pa = volume.bulk_modulus_pa.map(|pa| 1.1 * pa);
        volume.stiffness *= 0.99;
    }
    if let Some(stc) = &mut constraints.stc {
        stc.rest_area_scale *= 1.001;
    }
    if let Some(membrane) = &mut constraints.membrane {
        membrane.tension_along_n_per_m = Some(14.9);
        membrane.stiffness *= 0.99;
    }
    for (what, scene) in
        [(other_load, &otherwise_loaded), ("other stiffness, tension and rest areas", &stiffer)]
    {
        bench.control(Ring::Scene, &name, what, |gpu, policy| {
            Ok(state(&ran(scene, Some(gpu))?, expected, policy))
        })?;
    }

    let (Some(found), Some(expected_volume)) = (&found, &expected.volume) else { return Ok(()) };
    let name = format!("{}: deformed volume", case.name);
    bench.compare(Ring::Oracle, &name, |_, policy| {
        let volume = found.volume.as_ref().context("the run left no volume")?;
        let alike = policy == Policy::Exact && found.resampled_on_cpu;
        Ok(voxels(volume.voxels(), expected_volume.voxels(), alike))
    })?;
    bench.control(Ring::Oracle, &name, "shifted by a voxel", |_, policy| {
        let volume = found.volume.as_ref().context("the run left no volume")?;
        let mut shifted = volume.voxels().to_vec();
        shifted.rotate_left(1);
        Ok(voxels(&shifted, expected_volume.voxels(), policy == Policy::Exact && found.resampled_on_cpu))
    })
}

/// Runs a scene in a temporary folder, on a device or on the backend of the scene.
fn ran(loaded: &LoadedScene, gpu: Option<&Gpu>) -> Result<RunResult, Failure> {
    let folder = tempfile::tempdir()?;
    let options = RunOptions { out: folder.path().into(), resume: false };
    let report = match gpu {
        Some(gpu) => cutis::run_on(gpu, loaded, &options, &Silent)?,
        None => cutis::run(loaded, &options, &Silent)?,
    };
    let on = if gpu.is_some() { "gpu" } else { "cpu" };
    if report.backend.name != on {
        bail!("the run was on {}, not on {on}", report.backend.name);
    }
    let files = RunFolder(folder.path().into());
    let volume = match loaded.scene.output.volume {
        true => Some(nifti::read(files.volume())?.volume),
        false => None,
    };
    let resampled = report.stages.iter().find(|stage| stage.name.contains("resample"));
    Ok(RunResult {
        state: State::read(&files.checkpoint())?,
        substep_s: loaded.scene.solver.dt_s / f64::from(loaded.scene.solver.substeps),
        openings_mm: report
            .wounds
            .iter()
            .flat_map(|wound| [wound.final_mm as f32, wound.mid_mm as f32])
            .collect(),
        volume,
        resampled_on_cpu: resampled.is_none_or(|stage| stage.on == "cpu"),
    })
}

fn state(found: &RunResult, expected: &RunResult, policy: Policy) -> Measured {
    let extent = expected.state.extent();
    // A velocity is a difference of positions over a substep.
    let fastest = expected.state.velocities.iter().fold(0.0, |most: f64, &v| most.max(f64::from(v).abs()));
    let scale = fastest.max(extent / expected.substep_s);
    let numbers = |values: &[f32]| values.to_vec();
    Difference::default()
        .add(numbers(&found.state.positions), numbers(&expected.state.positions), extent)
        .add(numbers(&found.state.velocities), numbers(&expected.state.velocities), scale)
        .add(numbers(&found.openings_mm), numbers(&expected.openings_mm), 1e3 * extent)
        .judged(policy)
}

/// Share of voxels that differ. Unless both sides compute `alike`, a difference of 1 is ignored.
fn voxels(found: &[i16], expected: &[i16], alike: bool) -> Measured {
    let (least, tolerance) = if alike { (1, 0.0) } else { (2, SHARE) };
    let compared = found.len().max(expected.len());
    let equal = found.iter().zip(expected).filter(|(a, b)| a.abs_diff(**b) < least).count();
    let differing = (compared - equal) as u64;
    let worst = differing as f64 / compared.max(1) as f64;
    let figures = Figures { compared: compared as u64, differing, worst, tolerance, of: "all voxels" };
    Measured::new(worst <= tolerance, figures)
}
