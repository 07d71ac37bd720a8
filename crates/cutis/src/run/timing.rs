//! Times of the solver's parts.

use cutis_solver::StepProfile;

use crate::CostReport;

/// How the times of the solver's parts are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Timing {
    /// Not at all.
    No,
    /// In every frame, where timing does not slow a frame.
    EveryFrame,
    /// In one more frame, whose result is discarded. On a GPU the host waits for each part, which
    /// it does not do in a normal frame.
    ExtraFrame,
}

/// Times of the solver's parts.
pub(super) struct PartTimes {
    pub(super) profile: StepProfile,
    /// Number of frames in the profile.
    pub(super) frames: u32,
    pub(super) timing: Timing,
    /// Whether the times are timestamps of the GPU, and not the clock of the host.
    pub(super) stamped: bool,
}

impl PartTimes {
    pub(super) fn new(timing: Timing) -> Self {
        Self { profile: StepProfile::default(), frames: 0, timing, stamped: false }
    }

    /// Adds the times to a cost report, or the reason why there are none.
    pub(super) fn add_to(&self, costs: CostReport) -> CostReport {
        let how = match (self.timing, self.frames) {
            (Timing::No, _) => {
                return CostReport { time: "not measured: the scene writes no report".into(), ..costs };
            }
            (_, 0) => {
                return CostReport { time: "not measured: there was no frame to measure".into(), ..costs };
            }
            (Timing::EveryFrame, frames) => format!("mean of the {frames} frames of this run"),
            (Timing::ExtraFrame, _) if self.stamped => {
                "timestamps of the GPU in one extra frame, part by part".into()
            }
            (Timing::ExtraFrame, _) => {
                "one extra frame, part by part; the host waits for each part, so that together they take \
                 longer than a frame"
                    .into()
            }
        };
        costs.with_times(&self.profile, self.frames.into(), &how)
    }
}
