//! Records the work of frames: into one pass each, or, if somebody wants to know where the time goes, into one pass per part,
//! each of which is waited for.

use std::time::Instant;

use cutis_gpu::{Gpu, GpuError, Pass};
use cutis_solver::StepProfile;

/// A pass under way.
pub(crate) struct Recorder<'a> {
    gpu: &'a Gpu,
    pass: Pass<'a>,
    timed: Option<Timed<'a>>,
}

struct Timed<'a> {
    profile: &'a mut StepProfile,
    /// What the pass under way holds.
    part: &'static str,
}

impl<'a> Recorder<'a> {
    /// Begins; with a profile, the time of each part goes there.
    pub(crate) fn new(gpu: &'a Gpu, profile: Option<&'a mut StepProfile>) -> Self {
        let timed = profile.map(|profile| Timed { profile, part: StepProfile::VERTICES });
        Self { gpu, pass: gpu.pass("frame"), timed }
    }

    /// Where the work of a part is recorded.
    ///
    /// # Errors
    /// As the device gives them for the part before.
    pub(crate) fn part(&mut self, name: &'static str) -> Result<&mut Pass<'a>, GpuError> {
        if self.timed.as_ref().is_some_and(|timed| timed.part != name) {
            self.submit()?;
            self.timed.as_mut().into_iter().for_each(|timed| timed.part = name);
        }
        Ok(&mut self.pass)
    }

    /// Sends what was recorded, and waits for it where it is timed: by the timestamps of the device, where it was opened with
    /// them, else by the clock of the host, which sees the submission and the wait too.
    ///
    /// # Errors
    /// As the device gives them.
    pub(crate) fn submit(&mut self) -> Result<(), GpuError> {
        let pass = std::mem::replace(&mut self.pass, self.gpu.pass("frame, further on"));
        let Some(Timed { profile, part }) = &mut self.timed else { return pass.submit() };
        self.gpu.wait()?;
        let start = Instant::now();
        pass.submit()?;
        self.gpu.wait()?;
        let waited_s = start.elapsed().as_secs_f64();
        let stamped_s = self.gpu.last_pass_ns()?.map(|ns| ns as f64 * 1e-9);
        profile.add(part, stamped_s.unwrap_or(waited_s));
        Ok(())
    }
}
