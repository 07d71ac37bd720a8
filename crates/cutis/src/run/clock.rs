//! Measures the time and the memory of the stages of a run for the report, and announces them to
//! the user.

use std::time::Instant;

use super::peak_memory::PeakMemory;
use crate::output::report::Stage;
use crate::{Error, Progress};

/// Measures the stages of a run and announces them to the user.
pub(crate) struct Clock<'a> {
    pub(crate) progress: &'a dyn Progress,
    pub(crate) stages: Vec<Stage>,
    start: Instant,
}

impl<'a> Clock<'a> {
    pub(crate) fn new(progress: &'a dyn Progress) -> Self {
        Self { progress, stages: Vec::new(), start: Instant::now() }
    }

    /// Wall time since the clock was made, ms.
    pub(crate) fn total_ms(&self) -> f64 {
        self.start.elapsed().as_secs_f64() * 1e3
    }

    /// Runs one stage of `total` units (0: unknown) on the CPU.
    pub(crate) fn stage<T>(
        &mut self,
        name: &str,
        total: u64,
        work: impl FnOnce(&dyn Progress) -> Result<T, Error>,
    ) -> Result<T, Error> {
        self.stage_on("cpu", name, total, work)
    }

    /// Runs one stage of `total` units (0: unknown) on `on`, which is `cpu` or `gpu`.
    pub(crate) fn stage_on<T>(
        &mut self,
        on: &'static str,
        name: &str,
        total: u64,
        work: impl FnOnce(&dyn Progress) -> Result<T, Error>,
    ) -> Result<T, Error> {
        self.stage_placed(name, total, |progress| Ok((work(progress)?, on)))
    }

    /// Runs one stage of `total` units (0: unknown). The stage returns where it ran.
    pub(crate) fn stage_placed<T>(
        &mut self,
        name: &str,
        total: u64,
        work: impl FnOnce(&dyn Progress) -> Result<(T, &'static str), Error>,
    ) -> Result<T, Error> {
        self.progress.begin(name, total);
        let (memory, start) = (PeakMemory::start(), Instant::now());
        let result = work(self.progress);
        let ms = start.elapsed().as_secs_f64() * 1e3;
        let on = result.as_ref().map_or("", |(_, on)| on);
        self.stages.push(Stage { name: name.into(), ms, on: on.into(), peak_bytes: memory.bytes() });
        self.progress.end();
        result.map(|(value, _)| value)
    }
}
