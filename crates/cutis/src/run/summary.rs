//! The end of a run: measures the wounds and displacements, and writes the report.

use cutis_mesh::{Slit, WoundGape};

use super::clock::Clock;
use super::date::utc_now;
use super::files;
use super::frames::{FrameRow, frame_times, frames_csv};
use super::simulate::{Setup, Simulated, warn};
use super::stops::Settled;
use crate::Error;
use crate::backend::DeviceMeter;
use crate::body::Body;
use crate::model::ModelChoice;
use crate::output::report::{Machine, Report, SCHEMA, Wound};
use crate::output::step_report::HandleReport;
use crate::output::suture_report::SutureReport;
use crate::output::{OutputResults, html};
use crate::scene::{LoadedScene, SutureSection};

/// Collects the report of a run, and writes it if the scene asks for it.
///
/// # Errors
/// [`Error::File`] if a file cannot be written.
pub(super) fn report(
    setup: &Setup<'_>,
    simulated: Simulated,
    outputs: OutputResults,
    clock: Clock<'_>,
) -> Result<Report, Error> {
    let Setup { loaded, folder, source, body, .. } = *setup;
    let Simulated { mut plan, device, result, mut recorder } = simulated;
    let (rows, end) = (result.rows, result.end);
    let Settled { stops, last } = result.settled.unwrap_or_default();
    let (settling, settled) = last.unzip();
    let last = settled.as_ref().or(rows.last());
    let wounds = wounds(body, last);
    let rest = &body.mesh.positions;
    let moved = rest.iter().zip(&end.positions).map(|(a, b)| f64::from((b - a).norm()) * 1e3);
    let max_displacement_mm = moved.fold(0.0, f64::max);
    let border_displacement_mm = body.border_displacement_mm(&end.positions);
    let mut late = crossed_lips(loaded, body, &wounds);
    let border_mm = body.picked_region.and(border_displacement_mm);
    late.extend(narrow_region(border_mm, max_displacement_mm));
    let wanted = loaded.scene.run.error;
    late.extend(settling.as_ref().and_then(|rest| inexact_rest(rest.error, wanted)));
    warn(&mut plan, &late, clock.progress);
    let report = Report {
        schema: SCHEMA.into(),
        cutis_version: env!("CARGO_PKG_VERSION").into(),
        finished_at: utc_now(),
        total_ms: clock.total_ms(),
        machine: Machine::here(),
        inputs: source.inputs.clone(),
        scene: loaded.scene.clone(),
        backend: plan.backend,
        sizes: plan.sizes,
        materials: plan.materials,
        skin: body.skin_report.as_ref().map(Into::into),
        tension: plan.tension,
        membrane: plan.membrane,
        colors: plan.colors,
        colorings: plan.colorings,
        memory: plan.memory,
        device_memory: plan.device_memory,
        costs: result.times.add_to(plan.costs),
        device: device.as_ref().map(DeviceMeter::work),
        stages: clock.stages,
        frames: frame_times(&rows),
        rest: settling,
        stops,
        wound: wounds.first().cloned(),
        wounds,
        steps: plan.steps,
        free_pieces_ml: body.free_pieces_ml.clone(),
        sutures: sutures(loaded, body, last),
        handles: handles(body, last),
        resample: outputs.resample,
        chainmail: end.chainmail,
        residuals: end.residuals,
        max_displacement_mm,
        border_displacement_mm,
        left_out: plan.left_out,
        warnings: [plan.warnings, outputs.warnings].concat(),
    };
    if loaded.scene.output.report {
        files::write(&folder.frames(), frames_csv(&rows).as_bytes())?;
        let shown = html::Shown { body, rows: &rows, figures: &outputs.figures, slices: &outputs.slices };
        html::write(&report, &shown, recorder.as_mut(), folder)?;
        report.write(&folder.report())?;
    }
    Ok(report)
}

/// Displacement at the border of a region that was picked, over the largest one, above which it is
/// reported. The error of the opening is about this share (`docs/results/region.md`).
const NARROW: f64 = 0.05;
/// Displacement below which nothing has moved, mm. Rounding alone moves tissue by less.
const STILL_MM: f64 = 1e-3;

/// Note about a state of rest that is less exact than the scene wants.
fn inexact_rest(error: f64, wanted: f64) -> Option<String> {
    (error > wanted).then(|| {
        format!(
            "the state of rest has an estimated error of {:.2} %, more than run.error = {} %: the search ended \
             because the forces cancel to single precision. Take that error as the accuracy of this result: a \
             smaller run.error does not help",
            100.0 * error,
            100.0 * wanted
        )
    })
}

/// Warning about a region that the program picked and that holds the wounds back.
fn narrow_region(border_mm: Option<f64>, most_mm: f64) -> Option<String> {
    let border_mm = border_mm.filter(|&mm| mm > NARROW * most_mm && most_mm > STILL_MM)?;
    Some(format!(
        "tissue at the border of the picked region moved by {border_mm:.2} mm, and the largest displacement is \
         {most_mm:.2} mm: the region holds the wounds back. Set lattice.region to a larger zone or to \"whole\""
    ))
}

/// The sutures with the forces at the end.
fn sutures(loaded: &LoadedScene, body: &Body, last: Option<&FrameRow>) -> Vec<SutureReport> {
    let forces = last.map(|row| row.sutures.as_slice()).unwrap_or_default();
    let sections = loaded.scene.suture.iter().zip(&body.stitches).zip(forces);
    let report = |((section, stitches), &[force_n, largest_n]): ((&SutureSection, &Vec<_>), &[f64; 2])| {
        let wound = loaded.scene.wound(&section.wound).unwrap_or_default();
        let length_cm = wound_length(body, wound) * 100.0;
        SutureReport {
            wound,
            stitches: stitches.len(),
            force_n,
            force_n_per_cm: force_n / length_cm,
            largest_n,
        }
    };
    sections.map(report).collect()
}

/// Length of a wound in m: that of an incision, or of the long axis of an excision.
fn wound_length(body: &Body, wound: usize) -> f64 {
    let incisions = body.cut.incisions().map(|slits| slits.iter().map(Slit::length).sum::<f64>());
    let excisions = body.cut.pieces.iter().map(|piece| piece.axis().length());
    incisions.chain(excisions).nth(wound).unwrap_or_default()
}

/// The handles with the forces at the end.
fn handles(body: &Body, last: Option<&FrameRow>) -> Vec<HandleReport> {
    let forces = last.map(|row| row.handles.as_slice()).unwrap_or_default();
    let report = |(grabbed, &force_n): (&Vec<u32>, &f64)| HandleReport { vertices: grabbed.len(), force_n };
    body.grabbed.iter().zip(forces).map(report).collect()
}

/// Opening of each wound, in the scan and at the end.
fn wounds(body: &Body, last: Option<&FrameRow>) -> Vec<Wound> {
    let before = body.cut.gapes.iter().map(|gape| gape.measure(&body.mesh.positions));
    let after = last.map(|row| row.gapes.as_slice()).unwrap_or_default();
    let wound = |(before, after): (WoundGape, &WoundGape)| Wound {
        initial_mm: before.mean_mm,
        final_mm: after.mean_mm,
        mid_mm: after.mid_mm,
        initial_mid_mm: before.mid_mm,
    };
    before.zip(after).map(wound).collect()
}

/// Overlap of lips that touch above which it is reported, over the longest lattice step.
const PRESSED: f64 = 0.05;

/// Warnings about wounds whose lips have passed through each other, or are pressed together too
/// hard.
fn crossed_lips(loaded: &LoadedScene, body: &Body, wounds: &[Wound]) -> Vec<String> {
    let scene = &loaded.scene;
    let acts = scene.model == ModelChoice::Pbd
        && scene.constraints.contact.as_ref().is_some_and(|contact| contact.acts);
    let step_mm = body.mesh.lattice.longest_step_mm();
    let line = |(n, wound): (usize, &Wound)| {
        let depth = -wound.final_mm.min(wound.mid_mm);
        let section = match n.checked_sub(scene.incision.len()) {
            None => format!("incision[{n}]"),
            Some(n) => format!("excision[{n}]"),
        };
        // The walls of an excision have no pairs of points that touch.
        let paired = scene.incision.get(n).is_some_and(|incision| incision.width_mm.is_none());
        if acts && paired {
            let pressed = depth > PRESSED * step_mm;
            return pressed.then(|| {
                format!(
                    "the lips of {section} overlap by {depth:.2} mm although they touch: they are \
                     pressed together harder than the tissue withstands, or the solver needs more iterations"
                )
            });
        }
        (depth > 0.0).then(|| {
            format!(
                "the lips of {section} have passed through each other, by {depth:.2} mm: there is no contact. \
                 Leave width_mm out and set constraints.contact, or move them less"
            )
        })
    };
    wounds.iter().enumerate().filter_map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::{inexact_rest, narrow_region};

    #[test]
    fn a_region_whose_border_moves_is_reported() {
        assert_eq!(narrow_region(None, 10.0), None);
        assert_eq!(narrow_region(Some(0.49), 10.0), None);
        assert_eq!(narrow_region(Some(0.0), 0.0), None);
        // Where nothing moves, the displacements are those of rounding.
        assert_eq!(narrow_region(Some(1e-6), 2e-6), None);
        let warning = narrow_region(Some(0.51), 10.0).unwrap();
        assert!(warning.contains("0.51 mm") && warning.contains("lattice.region"), "{warning}");
    }

    #[test]
    fn a_rest_that_is_less_exact_than_wanted_is_reported() {
        assert_eq!(inexact_rest(0.001, 0.001), None);
        let note = inexact_rest(0.0032, 0.001).unwrap();
        assert!(note.contains("0.32 %") && note.contains("run.error = 0.1 %"), "{note}");
    }
}
