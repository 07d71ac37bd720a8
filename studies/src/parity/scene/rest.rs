//! The state of rest of the demo, with the equations of the search solved on a device and on the
//! CPU.

use anyhow::anyhow;
use cutis::LoadedScene;
use cutis::rest::{Body, Options, RestGpu};
use cutis_gpu::Gpu;
use cutis_newton::relative_rms;
use nalgebra::Point3;

use super::cases;
use crate::parity::bench::{Bench, Failure};
use crate::parity::comparison::{Measured, Ring};

/// Stated error at which both searches end.
const ERROR: f64 = 1e-8;
/// Largest distance between both states over the displacement, as roots of mean squares. A device
/// adds in another order, so that the bits differ.
const APART: f64 = 1e-6;

/// A state of rest and the start of the search, in m.
struct Found {
    start: Vec<Point3<f64>>,
    end: Vec<Point3<f64>>,
}

/// Compares the state of rest. Control: another tension of the skin.
pub fn compare(bench: &mut Bench<'_, '_>) -> Result<(), Failure> {
    let loaded = cases::coarse_demo(bench.effort)?;
    let mut tenser = loaded.clone();
    if let Some(membrane) = &mut tenser.scene.constraints.membrane {
        membrane.tension_along_n_per_m = Some(14.9);
    }
    let name = "demo, coarse: state of rest";
    let expected = settled(&loaded, None);
    let compared = |gpu: &Gpu, loaded: &LoadedScene| {
        let expected = expected.as_ref().map_err(|error| anyhow!("on the CPU: {error}"))?;
        let found = settled(loaded, Some(gpu))?;
        let apart = relative_rms(&found.end, &expected.end, &expected.start);
        Ok(Measured::at_most(3 * found.end.len() as u64, apart, APART, "the displacement"))
    };
    bench.compare(Ring::Oracle, name, |gpu, _| compared(gpu, &loaded))?;
    bench.control(Ring::Oracle, name, "another tension of the skin", |gpu, _| compared(gpu, &tenser))
}

/// Searches for the state of rest on a device or on the CPU.
fn settled(loaded: &LoadedScene, gpu: Option<&Gpu>) -> Result<Found, Failure> {
    let built = cutis::build_system(loaded)?;
    let body = Body::of(&built.system, built.settings.gravity_m_s2)?;
    let body = match gpu {
        Some(gpu) => body.on_gpu(&RestGpu::new(gpu)?),
        None => body,
    };
    let start = built.system.positions().iter().map(|x| x.cast()).collect();
    let rest = body.settle(&Options { error: ERROR, ..Options::default() }, &mut |_| ())?;
    Ok(Found { start, end: rest.positions })
}
