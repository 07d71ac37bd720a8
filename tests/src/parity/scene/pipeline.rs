//! A run of the whole pipeline on both backends: positions, velocities, openings of the wounds, the deformed volume.

use cutis::scene::BackendChoice;
use cutis::volume::{Volume, nifti};
use cutis::{LoadedScene, RunFolder, RunOptions, Silent};
use cutis_gpu::Gpu;

use super::cases::Case;
use super::checkpoint::State;
use crate::parity::bench::{Bench, Failure};
use crate::parity::difference::{Difference, Policy};
use crate::parity::outcome::{Figures, Measured, Ring};

/// Where voxels are not computed alike on both sides (a device resamples in single precision, the CPU in double), the share of
/// them whose value may differ by more than 1: those at faces, which two tets share. Measured: 3e-5.
const SHARE: f64 = 3e-4;

/// What a run leaves that is compared.
struct Ran {
    state: State,
    openings_mm: Vec<f32>,
    substep_s: f64,
    volume: Option<Volume>,
    /// Whether the volume was resampled by the CPU, in double precision.
    resampled_on_cpu: bool,
}

/// One row for the state, one for the volume where the scene has it, and their controls.
pub fn compare(bench: &mut Bench<'_, '_>, case: &Case) -> Result<(), Failure> {
    let name = format!("{}: state and openings", case.name);
    let mut on_cpu = case.loaded.clone();
    on_cpu.scene.solver.backend = BackendChoice::Cpu;
    let expected = ran(&on_cpu, None);
    let mut found = None;
    bench.compare(Ring::Scene, &name, |gpu, policy| {
        let expected = expected.as_ref().map_err(|error| format!("on the CPU: {error}"))?;
        Ok(state(found.insert(ran(&case.loaded, Some(gpu))?), expected, policy))
    })?;
    let Ok(expected) = &expected else { return Ok(()) };

    // Controls are run without the volume, which is compared below.
    let mut heavier = case.loaded.clone();
    heavier.scene.output.volume = false;
    let mut stiffer = heavier.clone();
    for g in &mut heavier.scene.solver.gravity_m_s2 {
        *g += 0.01;
    }
    let constraints = &mut stiffer.scene.constraints;
    if let Some(distance) = &mut constraints.distance {
        distance.youngs_modulus_pa *= 1.1;
        distance.stiffness *= 0.99;
    }
    if let Some(volume) = &mut constraints.volume {
        volume.bulk_modulus_pa *= 1.1;
        volume.stiffness *= 0.99;
    }
    if let Some(stc) = &mut constraints.stc {
        stc.rest_area_scale *= 1.001;
    }
    for (what, scene) in
        [("gravity off by 0.01 m/s²", &heavier), ("other stiffness and rest areas", &stiffer)]
    {
        bench.control(Ring::Scene, &name, what, |gpu, policy| {
            Ok(state(&ran(scene, Some(gpu))?, expected, policy))
        })?;
    }

    let (Some(found), Some(expected_volume)) = (&found, &expected.volume) else { return Ok(()) };
    let name = format!("{}: deformed volume", case.name);
    bench.compare(Ring::Oracle, &name, |_, policy| {
        let volume = found.volume.as_ref().ok_or("the run left no volume")?;
        let alike = policy == Policy::Exact && found.resampled_on_cpu;
        Ok(voxels(volume.voxels(), expected_volume.voxels(), alike))
    })?;
    bench.control(Ring::Oracle, &name, "shifted by a voxel", |_, policy| {
        let volume = found.volume.as_ref().ok_or("the run left no volume")?;
        let mut shifted = volume.voxels().to_vec();
        shifted.rotate_left(1);
        Ok(voxels(&shifted, expected_volume.voxels(), policy == Policy::Exact && found.resampled_on_cpu))
    })
}

/// Runs a scene in a folder of its own, on a device or as it says.
fn ran(loaded: &LoadedScene, gpu: Option<&Gpu>) -> Result<Ran, Failure> {
    let folder = tempfile::tempdir()?;
    let options = RunOptions { out: folder.path().into(), resume: false };
    let report = match gpu {
        Some(gpu) => cutis::run_on(gpu, loaded, &options, &Silent)?,
        None => cutis::run(loaded, &options, &Silent)?,
    };
    let on = if gpu.is_some() { "gpu" } else { "cpu" };
    if report.backend.name != on {
        return Err(format!("it ran on {}, not on {on}", report.backend.name).into());
    }
    let files = RunFolder(folder.path().into());
    let volume = match loaded.scene.output.volume {
        true => Some(nifti::read(files.volume())?.volume),
        false => None,
    };
    let resampled = report.stages.iter().find(|stage| stage.name.contains("resample"));
    Ok(Ran {
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

fn state(found: &Ran, expected: &Ran, policy: Policy) -> Measured {
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

/// Share of voxels that differ, by more than 1 where the two sides do not compute alike.
fn voxels(found: &[i16], expected: &[i16], alike: bool) -> Measured {
    let (least, tolerance) = if alike { (1, 0.0) } else { (2, SHARE) };
    let compared = found.len().max(expected.len());
    let equal = found.iter().zip(expected).filter(|(a, b)| a.abs_diff(**b) < least).count();
    let differing = (compared - equal) as u64;
    let worst = differing as f64 / compared.max(1) as f64;
    let figures = Figures { compared: compared as u64, differing, worst, tolerance, of: "all voxels" };
    Measured::new(worst <= tolerance, figures)
}
