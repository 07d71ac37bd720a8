//! The stages after the simulation: on the GPU if the simulation ran there, else on the CPU.

use cutis_render::{Image, View};
use cutis_resample::{ResampleReport, Warp};
use cutis_volume::Volume;

use super::gpu::{self, Gpu};
use crate::Error;

/// What resampling and pictures run on.
pub(crate) struct Stages {
    gpu: Option<Gpu>,
    /// What the device could not take, and was done by the CPU.
    pub(crate) notes: Vec<String>,
}

impl Stages {
    pub(crate) fn on(gpu: Option<Gpu>) -> Self {
        Self { gpu, notes: Vec::new() }
    }

    /// `cpu` or `gpu`, for the report.
    pub(crate) fn place(&self) -> &'static str {
        if self.gpu.is_some() { "gpu" } else { "cpu" }
    }

    /// As [`cutis_resample::resample`].
    pub(crate) fn resample(
        &mut self,
        volume: &Volume,
        warp: &Warp<'_>,
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<(Volume, ResampleReport), Error> {
        self.first_on_gpu(
            "resampling",
            |gpu| Ok(gpu::resample(gpu, volume, warp, progress)?),
            || Ok(cutis_resample::resample(volume, warp, progress)?),
        )
    }

    /// As [`cutis_render::raymarch`].
    pub(crate) fn raymarch(&mut self, volume: &Volume, view: &View<'_>) -> Result<Image, Error> {
        self.first_on_gpu(
            "ray marching",
            |gpu| Ok(gpu::raymarch(gpu, volume, view)?),
            || Ok(cutis_render::raymarch(volume, view)?),
        )
    }

    /// Tries the GPU. Too little room on it, or its loss, is no reason to lose a finished simulation: the CPU does the stage
    /// and all that follows, and the report says so.
    fn first_on_gpu<T>(
        &mut self,
        what: &str,
        on_gpu: impl FnOnce(&Gpu) -> Result<T, Error>,
        on_cpu: impl FnOnce() -> Result<T, Error>,
    ) -> Result<T, Error> {
        let Some(gpu) = &self.gpu else { return on_cpu() };
        match on_gpu(gpu) {
            Err(error) if gpu::lacks_device(&error) => {
                self.notes.push(format!("{what} ran on the CPU: {error}"));
                self.gpu = None;
                on_cpu()
            }
            done => done,
        }
    }
}
