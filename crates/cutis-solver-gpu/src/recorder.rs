//! Records the work of a frame in one pass, or in one timed pass per part.

use std::time::Instant;

use cutis_gpu::{Gpu, GpuError, Pass};
use cutis_solver::StepProfile;

/// A pass that is being recorded.
pub(crate) struct Recorder<'a> {
    gpu: &'a Gpu,
    pass: Pass<'a>,
    profiling: Option<Profiling<'a>>,
}

struct Profiling<'a> {
    profile: &'a mut StepProfile,
    /// The part of the step that the present pass belongs to.
    part: &'static str,
}

impl<'a> Recorder<'a> {
    /// Starts a pass. With a profile, each part gets its own pass, and its duration goes to the
    /// profile.
    pub(crate) fn new(gpu: &'a Gpu, profile: Option<&'a mut StepProfile>) -> Self {
        let profiling = profile.map(|profile| Profiling { profile, part: StepProfile::VERTICES });
        Self { gpu, pass: gpu.pass("frame"), profiling }
    }

    /// Returns the pass that records the work of `part`.
    ///
    /// # Errors
    /// Returns the errors of [`submit`](Self::submit) for the previous part.
    pub(crate) fn pass_for(&mut self, part: &'static str) -> Result<&mut Pass<'a>, GpuError> {
        if self.profiling.as_ref().is_some_and(|profiling| profiling.part != part) {
            self.submit()?;
            self.profiling.as_mut().into_iter().for_each(|profiling| profiling.part = part);
        }
        Ok(&mut self.pass)
    }

    /// Submits the recorded work and starts a new pass. With a profile, waits for the work and adds
    /// its duration: by the timestamps of the device if it was opened with them, else by the clock
    /// of the host, which includes the submission and the wait.
    ///
    /// # Errors
    /// Returns the errors of the device.
    pub(crate) fn submit(&mut self) -> Result<(), GpuError> {
        let pass = std::mem::replace(&mut self.pass, self.gpu.pass("frame, continued"));
        let Some(Profiling { profile, part }) = &mut self.profiling else { return pass.submit() };
        self.gpu.wait()?;
        let start = Instant::now();
        pass.submit()?;
        self.gpu.wait()?;
        let host_s = start.elapsed().as_secs_f64();
        let device_s = self.gpu.last_pass_ns()?.map(|ns| ns as f64 * 1e-9);
        profile.add(part, device_s.unwrap_or(host_s));
        Ok(())
    }
}
