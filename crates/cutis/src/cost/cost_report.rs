//! The cost report: bytes and time of the solver, part by part.

use cutis_solver::StepProfile;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::model::constraints::kinds::report_name;
use crate::output::report::MemoryPart;

/// The cost of the solver, part by part.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct CostReport {
    /// Parts that store something, then parts that only take time. A part that the scene leaves out
    /// is not listed.
    pub parts: Vec<CostPart>,
    /// How the times were measured, or why they were not.
    pub time: String,
}

/// The cost of one part of the solver.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CostPart {
    /// `vertices`, a constraint kind, `handles`, `multipliers`, `check` (whether all positions are
    /// finite), …
    pub part: String,
    /// Bytes on the host.
    pub host_bytes: usize,
    /// Bytes on the GPU; 0 on a CPU backend.
    pub device_bytes: usize,
    /// Time of a frame spent in this part, ms; none if it was not measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ms_per_frame: Option<f64>,
}

impl CostReport {
    /// A report of bytes without times. `why` says why there are no times.
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

    /// Adds the times of `frames` frames. `how` says how they were measured.
    pub(crate) fn with_times(mut self, times: &StepProfile, frames: f64, how: &str) -> Self {
        for time in times.parts() {
            let part = self.part(report_name(time.name));
            *part.ms_per_frame.get_or_insert(0.0) += time.seconds * 1e3 / frames;
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

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(part: &str, bytes: usize) -> MemoryPart {
        MemoryPart { part: part.into(), bytes }
    }

    /// The solver calls the paper's form of skin tension `stc_paper`; its time belongs to the kind
    /// `stc`.
    #[test]
    fn bytes_and_times_of_a_part_are_joined_by_its_name() {
        let (host, device) = ([bytes("vertices", 40), bytes("stc", 12)], [bytes("vertices", 48)]);
        let without = CostReport::of_memory(&host, &device, "no device");
        assert_eq!((without.ms_per_frame(), without.time.as_str()), (None, "no device"));
        for solver_name in ["stc", "stc_paper"] {
            let mut times = StepProfile::default();
            times.add(solver_name, 0.5);
            times.add("check", 0.25);
            let with = without.clone().with_times(&times, 2.0, "by hand");
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
}
