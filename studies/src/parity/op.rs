//! The inner ring: value and gradients of each constraint on thousands of random shapes at 1 mm, 1
//! m and 1 km, and on degenerate shapes.
//!
//! These are the checks of `cutis-conformance`. The error of a device against `f64` may be at most
//! 4 times the error of the CPU in `f32`. On software adapters every number has to equal the number
//! of the CPU. The controls change the value or a gradient by 1e-3, swap gradients, or change the
//! exponent of infinity.

use cutis_conformance::{ConformanceError, Finding, Limit, Report, Subject, device};
use cutis_constraints::{
    Constraint, Distance, DistanceMaterial, LipAdhesion, LipContact, LipContactMaterial, MaterialError,
    SkinStrip, SkinStripAtRest, SkinStripLaw, SkinStripMaterial, SkinStripTurn, SkinTension,
    SkinTensionMaterial, SkinTensionPaper, SkinTensionPaperMaterial, Thread, ThreadMaterial, Volume,
    VolumeMaterial,
};
use cutis_gpu::Gpu;

use super::bench::{Bench, Effort, Failure};
use super::comparison::{Figures, Measured, Ring};

/// Runs the ring.
pub fn run(bench: &mut Bench<'_, '_>) -> Result<(), Failure> {
    // Each material comes with 100 random shapes per scale.
    let materials = if bench.effort == Effort::Quick { 4 } else { 40 };
    let shares = move || (0..materials).map(move |n| 0.5 + f64::from(n) / f64::from(materials));
    let tension = |scale| SkinTensionMaterial { rest_area_scale: scale, amplification: 4.0 * scale - 1.0 };
    let paper = |scale| SkinTensionPaperMaterial {
        rest_area_scale: scale,
        amplification: 2.0 * scale,
        max_amplification: 3.0 * scale,
    };
    examine(bench, &Subject::<Distance, 2>::new(shares().map(|rest_scale| DistanceMaterial { rest_scale })))?;
    examine(bench, &Subject::<Volume, 4>::new(shares().map(|rest_scale| VolumeMaterial { rest_scale })))?;
    examine(bench, &Subject::<SkinTension, 3>::new(shares().map(tension)))?;
    examine(bench, &Subject::<SkinTensionPaper, 3>::new(shares().map(paper)).direction_only())?;
    let thread = |share: f64| ThreadMaterial {
        ends: [[0.3 * share, 0.2], [0.5 - 0.2 * share, 0.4]],
        length_scale: 1.6 - share,
    };
    examine(bench, &Subject::<Thread, 6>::new(shares().map(thread)))?;
    let contact = |share: f64| {
        let normal = [0.6, 0.8 * (1.0 - share), 0.8 * share];
        let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
        LipContactMaterial { part: share - 0.5, normal: normal.map(|x| x / length) }
    };
    examine(bench, &Subject::<LipContact, 4>::new(shares().map(contact)).oriented())?;
    examine(bench, &Subject::<LipAdhesion, 4>::new(shares().map(contact)).oriented())?;
    let strips = || shares().map(strip).collect::<Result<Vec<_>, _>>();
    examine(bench, &Subject::<SkinStrip, 3>::new(strips()?).oriented())?;
    examine(bench, &Subject::<SkinStripAtRest, 3>::new(strips()?).oriented())?;
    examine(bench, &Subject::<SkinStripTurn, 3>::new(strips()?).oriented())
}

/// A strip with a part of the largest tension, which also sets the other values and the direction.
fn strip(share: f64) -> Result<SkinStripMaterial, MaterialError> {
    let law = SkinStripLaw {
        tension_n_per_m: 48.0 * (share - 0.5) + 1.0,
        modulus_n_per_m: 50.0,
        stiffening: 8.0 * share,
        compression: 1.5 - share,
    };
    SkinStripMaterial::new([0.3, -0.2, 1.0], [share, 1.0 - share, 0.1], law)
}

fn examine<C: Constraint<N>, const N: usize>(
    bench: &mut Bench<'_, '_>,
    subject: &Subject<C, N>,
) -> Result<(), Failure> {
    let numbers = subject.cases().len() * (1 + 3 * N);
    check(bench, &format!("{}: C and ∇C", C::NAME), (numbers, ALLOWED), |gpu| {
        device::evaluation(subject, gpu)
    })?;
    check(bench, &format!("{}: degenerate shapes", C::NAME), (0, "shapes that are not finite"), |gpu| {
        device::degenerate(subject, gpu)
    })
}

const ALLOWED: &str = "what f64 allows";

/// Adds a check and its controls. `compared` is the number of compared numbers and the unit of the
/// figures.
fn check(
    bench: &mut Bench<'_, '_>,
    name: &str,
    compared: (usize, &'static str),
    examine: impl FnOnce(&Gpu) -> Result<Report, ConformanceError>,
) -> Result<(), Failure> {
    let mut report = None;
    bench.compare(Ring::Op, name, |gpu, _| Ok(comparison(report.insert(examine(gpu)?), compared)))?;
    for (what, rows) in report.iter().flat_map(|report| controls(&report.findings)) {
        let agrees = !rows.iter().all(|row| row.passed());
        let figures = Figures {
            compared: 1,
            differing: 1,
            worst: rows[0].value,
            tolerance: bound(rows[0]),
            of: compared.1,
        };
        bench.control(Ring::Op, name, what, |_, _| Ok(Measured { agrees, figures }))?;
    }
    Ok(())
}

/// The controls with their rows. On a software adapter a control has two rows, one for the
/// tolerance and one for equality.
fn controls(rows: &[Finding]) -> Vec<(&str, Vec<&Finding>)> {
    let mut found: Vec<(&str, Vec<&Finding>)> = Vec::new();
    for row in rows.iter().filter(|row| row.is_control()) {
        let what = row.what.trim_start_matches("control, ").trim_end_matches(", other numbers");
        match found.last_mut() {
            Some((last, rows)) if *last == what => rows.push(row),
            _ => found.push((what, vec![row])),
        }
    }
    found
}

fn bound(row: &Finding) -> f64 {
    match row.limit {
        Limit::AtMost(bound) | Limit::MoreThan(bound) => bound,
    }
}

/// All rows of a report as one result: the largest figure over its bound, and the number of
/// differing numbers.
fn comparison(report: &Report, (compared, of): (usize, &'static str)) -> Measured {
    let rows = || report.findings.iter().filter(|row| !row.is_control());
    let differing: f64 = rows().filter(|row| bound(row) == 0.0).map(|row| row.value).sum();
    let relative = rows().filter(|row| bound(row) > 0.0).map(|row| row.value / bound(row));
    let worst = relative.fold(differing.min(1.0), f64::max);
    let agrees = rows().all(Finding::passed);
    let compared = compared.max(rows().count()) as u64;
    let figures = Figures { compared, differing: differing as u64, worst, tolerance: 1.0, of };
    Measured::new(agrees, figures)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(what: &str, value: f64, limit: Limit) -> Finding {
        Finding { what: what.into(), value, limit }
    }

    #[test]
    fn a_report_becomes_a_comparison_and_controls() {
        let report = |different, seen| Report {
            constraint: "c",
            check: "evaluation",
            adapter: None,
            skipped: None,
            findings: vec![
                row("value", 1.0, Limit::AtMost(4.0)),
                row("different from the CPU", different, Limit::AtMost(0.0)),
                row("control, value × 1.001", 500.0, Limit::MoreThan(1.0)),
                row("control, value × 1.001, other numbers", seen, Limit::MoreThan(0.0)),
                row("control, swapped", 2e3, Limit::MoreThan(1.0)),
            ],
            notes: Vec::new(),
        };
        let found = comparison(&report(0.0, 9.0), (100, "allowed"));
        assert!(found.agrees);
        assert_eq!((found.figures.compared, found.figures.differing, found.figures.worst), (100, 0, 0.25));
        let found = comparison(&report(3.0, 9.0), (100, "allowed"));
        assert!(!found.agrees);
        assert_eq!((found.figures.differing, found.figures.worst), (3, 1.0));

        let rows = report(0.0, 0.0).findings;
        let controls = controls(&rows);
        let seen = |n: usize| controls[n].1.iter().all(|row| row.passed());
        assert_eq!((controls[0].0, controls[0].1.len(), seen(0)), ("value × 1.001", 2, false));
        assert_eq!((controls[1].0, seen(1)), ("swapped", true));
    }
}
