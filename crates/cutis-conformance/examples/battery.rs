//! Runs the battery on the skin tension constraint and prints all results. Checks on a GPU run if
//! there is one.
//!
//! `cargo run -p cutis-conformance --example battery`
#![allow(clippy::print_stdout)] // an example prints its results

use cutis_conformance::{ConformanceError, Subject, Verdict, device, on_device, on_host};
use cutis_constraints::{SkinTension, SkinTensionMaterial};

fn main() -> Result<(), ConformanceError> {
    let material = SkinTensionMaterial { rest_area_scale: 0.8, amplification: 2.0 };
    let subject = Subject::<SkinTension, 3>::new([material]);
    let mut reports = on_host(&subject)?;
    if let Some(gpu) = device::open()? {
        reports.extend(on_device(&subject, &gpu)?);
    }
    for report in &reports {
        println!("{report}");
    }
    let passed = reports.iter().filter(|report| report.verdict() == Verdict::Passed).count();
    println!("{passed} of {} checks passed", reports.len());
    Ok(())
}
