//! The stages after the simulation: on the GPU if the simulation ran there, else on the CPU.

use cutis_render::{Image, View};
use cutis_resample::{ResampleReport, Warp};
use cutis_volume::Volume;
use nalgebra::Point3;

use super::gpu::{self, Gpu};
use crate::Error;
use crate::backend::DevicePositions;

/// The GPU of the stages after the simulation, if they have one.
pub(crate) struct Stages {
    gpu: Option<Gpu>,
    /// Stages that the CPU ran because the GPU could not.
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

    /// Appends uploaded positions to those on the GPU. `None` if the GPU is not used or has too
    /// little memory.
    pub(crate) fn append(
        &self,
        positions: &DevicePositions,
        further: &[Point3<f32>],
    ) -> Option<DevicePositions> {
        positions.with(self.gpu.as_ref()?, further).ok()
    }

    /// Resamples as [`cutis_resample::resample`]. `positions` are the deformed positions of the
    /// warp, if they are on the GPU.
    pub(crate) fn resample(
        &mut self,
        volume: &Volume,
        warp: &Warp<'_>,
        positions: Option<&DevicePositions>,
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<(Volume, ResampleReport), Error> {
        self.first_on_gpu(
            "resampling",
            |gpu| Ok(gpu::resample(gpu, volume, warp, positions, progress)?),
            || Ok(cutis_resample::resample(volume, warp, progress)?),
        )
    }

    /// Resamples as [`cutis_resample::resample_where`]. The GPU resamples all parts.
    pub(crate) fn resample_where(
        &mut self,
        volume: &Volume,
        warp: &Warp<'_>,
        positions: Option<&DevicePositions>,
        is_needed: &dyn Fn(Point3<f64>, f64) -> bool,
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<(Volume, ResampleReport), Error> {
        self.first_on_gpu(
            "resampling",
            |gpu| Ok(gpu::resample(gpu, volume, warp, positions, progress)?),
            || Ok(cutis_resample::resample_where(volume, warp, is_needed, progress)?),
        )
    }

    /// Renders as [`cutis_render::raymarch`].
    pub(crate) fn raymarch(&mut self, volume: &Volume, view: &View<'_>) -> Result<Image, Error> {
        self.first_on_gpu(
            "ray marching",
            |gpu| Ok(gpu::raymarch(gpu, volume, view)?),
            || Ok(cutis_render::raymarch(volume, view)?),
        )
    }

    /// Tries the GPU. If it lacks memory or is lost, the CPU runs this stage and all later ones, so
    /// that a finished simulation is not lost; the report says so.
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
