//! The cost report: bytes and time of the solver, part by part.

use std::time::Instant;

use cutis_solver::{Settings, StepProfile, System};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Error;
use crate::backend::Chosen;
use crate::model::Motion;
use crate::report::MemoryPart;

/// Time after which the measurement of a plan ends, s; one substep is always measured.
const LONG_ENOUGH_S: f64 = 0.1;

/// What the solver costs, part by part.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct CostReport {
    /// The parts that store something, then those that only take time. What the scene leaves out has no part.
    pub parts: Vec<CostPart>,
    /// How the times were measured, or why they were not.
    pub time: String,
}

/// What one part of the solver costs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CostPart {
    /// `vertices`, a constraint kind, `handles`, `multipliers`, `check` (whether all positions are finite), …
    pub part: String,
    /// Bytes on the host.
    pub host_bytes: usize,
    /// Bytes on the GPU; 0 on a CPU backend.
    pub device_bytes: usize,
    /// Wall time of a frame that is spent in it, ms; none if it was not measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ms_per_frame: Option<f64>,
}

impl CostReport {
    /// Bytes without times. `why` there are none.
    pub(crate) fn of_memory(host: &[MemoryPart], device: &[MemoryPart], why: &str) -> Self {
        let mut report = Self { parts: Vec::new(), time: why.into() };
        for MemoryPart { part, bytes } in host {
            report.part(part).host_bytes += bytes;
        }
        for MemoryPart { part, bytes } in device {
            report.part(part).device_bytes += bytes;
        }
        report
    }

    /// The same with the times of `frames` frames. `how` they were measured.
    pub(crate) fn with_times(mut self, times: &StepProfile, frames: f64, how: &str) -> Self {
        for time in times.parts() {
            *self.part(time.name).ms_per_frame.get_or_insert(0.0) += time.seconds * 1e3 / frames;
        }
        self.time = how.into();
        self
    }

    /// Milliseconds of a frame in all parts; none if no time was measured.
    pub fn ms_per_frame(&self) -> Option<f64> {
        let mut measured = self.parts.iter().filter_map(|part| part.ms_per_frame).peekable();
        measured.peek().is_some().then(|| measured.sum())
    }

    fn part(&mut self, name: &str) -> &mut CostPart {
        let place = self.parts.iter().position(|part| part.part == name).unwrap_or_else(|| {
            let part = name.to_owned();
            self.parts.push(CostPart { part, host_bytes: 0, device_bytes: 0, ms_per_frame: None });
            self.parts.len() - 1
        });
        &mut self.parts[place]
    }
}

/// Iterations of a substep that are measured; the time of further ones is taken to be the same.
const MOST_ITERATIONS: u32 = 4;

/// Measures a substep of a system that is no longer needed, on a backend of the host: a first one to touch all memory, then as
/// many as fit into a tenth of a second.
///
/// # Errors
/// As the backend gives them; numbers that explode are an error of the run, and not of its plan.
pub(crate) fn of_substeps(
    backend: &Chosen,
    system: System<f32>,
    settings: Settings,
    bytes: CostReport,
) -> Result<CostReport, Error> {
    let iterations = settings.iterations.min(MOST_ITERATIONS);
    let substep = Settings { dt_s: settings.substep_s(), substeps: 1, iterations, ..settings };
    let mut solver = backend.start(system, substep)?.solver;
    let (mut times, mut done) = (StepProfile::default(), 0.0);
    if let Err(error) = solver.step(1) {
        return Ok(CostReport { time: format!("not measured: {error}"), ..bytes });
    }
    let start = Instant::now();
    while done == 0.0 || start.elapsed().as_secs_f64() < LONG_ENOUGH_S {
        if solver.step_timed(1, &mut times).is_err() {
            break;
        }
        done += 1.0;
    }
    let mut whole = StepProfile::default();
    for part in times.parts() {
        let once =
            [StepProfile::VERTICES, StepProfile::HANDLES, StepProfile::MULTIPLIERS, StepProfile::CHECK]
                .contains(&part.name);
        let times = if once { 1.0 } else { f64::from(settings.iterations) / f64::from(iterations) };
        whole.add(part.name, part.seconds * times);
    }
    let how = format!("{done} substeps of the body at rest, on this machine as busy as it is now");
    Ok(bytes.with_times(&whole, f64::max(done, 1.0) / f64::from(settings.substeps), &how))
}

/// Measures the first frame of a body that is no longer needed.
///
/// # Errors
/// As the frame gives them.
pub(crate) fn of_first_frame(motion: &mut dyn Motion, bytes: CostReport) -> Result<CostReport, Error> {
    let mut times = StepProfile::default();
    motion.step_timed(&mut times)?;
    Ok(bytes.with_times(&times, 1.0, "the first frame, on this machine as busy as it is now"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(part: &str, bytes: usize) -> MemoryPart {
        MemoryPart { part: part.into(), bytes }
    }

    #[test]
    fn bytes_and_times_meet_by_name() {
        let (host, device) = ([bytes("vertices", 40), bytes("stc", 12)], [bytes("vertices", 48)]);
        let without = CostReport::of_memory(&host, &device, "no device");
        assert_eq!((without.ms_per_frame(), without.time.as_str()), (None, "no device"));
        let mut times = StepProfile::default();
        times.add("stc", 0.5);
        times.add("check", 0.25);
        let with = without.with_times(&times, 2.0, "by hand");
        let part = |part: &str, host_bytes, device_bytes, ms_per_frame| CostPart {
            part: part.into(),
            host_bytes,
            device_bytes,
            ms_per_frame,
        };
        let expected = [
            part("vertices", 40, 48, None),
            part("stc", 12, 0, Some(250.0)),
            part("check", 0, 0, Some(125.0)),
        ];
        assert_eq!(with.parts, expected);
        assert_eq!((with.ms_per_frame(), with.time.as_str()), (Some(375.0), "by hand"));
    }
}
