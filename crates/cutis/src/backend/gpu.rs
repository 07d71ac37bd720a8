//! GPUs: the adapter that a scene means, the adapters of this machine, and opening one.

use cutis_gpu::{Adapter, AdapterKind, Buffer, GpuError, GpuOptions, Select, adapters};
use cutis_render::RenderError;
use cutis_resample::{ResampleError, ResampleReport, ResamplerGpu, ResamplerOptions, Warp, resample_gpu};
use cutis_rest::RestGpu;
use cutis_volume::Volume;
use nalgebra::Point3;

use super::auto::{self, Verdict, select};
use super::devices::{Device as Listed, DeviceLimits};
use super::{Chosen, Place, Work};
use crate::output::report::{Backend, DeviceWork};
use crate::scene::{SceneFile, SolverSection};
use crate::{Devices, Error};

pub(crate) use cutis_gpu::Gpu;
pub(super) use cutis_render::raymarch_gpu as raymarch;

/// The reason why there is no GPU: none, because this build has the backend.
pub(crate) const ABSENT: Option<&str> = None;

/// The GPU to use.
pub(super) enum Device {
    /// Index in [`adapters`] of a GPU that is not open yet.
    Adapter(usize),
    /// A GPU that is open.
    Opened(Gpu),
}

/// The GPU that a scene names by `backend = "gpu"`.
pub(super) fn named_by_scene(
    file: SceneFile<'_>,
    solver: &SolverSection,
    reason: &str,
) -> Result<Chosen, Error> {
    let all = adapters();
    let adapter = select(solver.adapter.as_deref()).among(&all).map_err(|e| refused(file, e))?;
    Ok(chosen(adapter, Device::Adapter(adapter.index), reason))
}

/// A GPU that the caller opened.
pub(super) fn opened(gpu: &Gpu) -> Chosen {
    chosen(gpu.adapter(), Device::Opened(gpu.clone()), "the caller opened it")
}

/// The backend that `auto` selects.
pub(super) fn auto(file: SceneFile<'_>, solver: &SolverSection, work: &Work) -> Result<Chosen, Error> {
    let verdict = auto::weigh(work, solver.adapter.as_deref(), adapters);
    Ok(match verdict.map_err(|e| refused(file, e))? {
        Verdict::Cpu(reason) => Chosen::cpu(solver, &format!("auto: {reason}")),
        Verdict::Gpu(adapter, reason) => {
            chosen(&adapter, Device::Adapter(adapter.index), &format!("auto: {reason}"))
        }
    })
}

/// The GPUs of this machine; each is opened once.
pub(super) fn devices() -> Devices {
    let all = adapters();
    let devices: Vec<Listed> = all.iter().map(listed).collect();
    let (auto, note) = selected_by_auto(&all, &devices);
    Devices { gpu_backend: true, auto, note, devices }
}

/// Index of the adapter that `auto` selects for a large scene, if it can be opened, and a note
/// about it.
fn selected_by_auto(all: &[Adapter], listed: &[Listed]) -> (Option<usize>, String) {
    let Some(first) = all.first() else {
        return (None, format!("\"auto\" uses the CPU backend: {}", GpuError::NoAdapter));
    };
    let Some((adapter, device)) =
        all.iter().zip(listed).find(|(adapter, _)| auto::objection(adapter).is_none())
    else {
        let why = auto::objection(first).unwrap_or_default();
        return (None, format!("\"auto\" uses the CPU backend: {why}"));
    };
    match &device.why {
        None => (
            Some(adapter.index),
            format!("\"auto\" selects {} for a scene that is large enough", adapter.name),
        ),
        Some(why) => {
            let note = format!(
                "\"auto\" selects {} for a scene that is large enough, and fails: {why}; name another \
                 with --adapter, or use \"cpu\"",
                adapter.name
            );
            (None, note)
        }
    }
}

fn listed(adapter: &Adapter) -> Listed {
    let select = Select::Index(adapter.index);
    let opened = Gpu::open(&GpuOptions { select, ..GpuOptions::default() });
    Listed {
        index: adapter.index,
        name: adapter.name.clone(),
        kind: adapter.kind.to_string(),
        api: adapter.api.into(),
        driver: adapter.driver.clone(),
        limits: DeviceLimits {
            max_buffer_bytes: adapter.limits.max_buffer_bytes,
            max_binding_bytes: adapter.limits.max_binding_bytes,
            max_workgroups: adapter.limits.max_workgroups,
            max_texture_3d: adapter.limits.max_texture_3d,
            storage_buffers_per_stage: adapter.limits.storage_buffers_per_stage,
        },
        usable: opened.is_ok(),
        why: opened.err().map(|error| error.to_string()),
    }
}

fn refused(file: SceneFile<'_>, error: GpuError) -> Error {
    let (key, why) = match &error {
        GpuError::NoAdapter => ("solver.backend", format!("{error}; or use \"cpu\" or \"auto\"")),
        _ => ("solver.adapter", format!("{error}; `cutis devices` describes them")),
    };
    file.blame(key)(Error::Backend { backend: "gpu".into(), why })
}

fn chosen(adapter: &Adapter, device: Device, reason: &str) -> Chosen {
    let note = format!(
        "{} is a software device: the processor computes, and slower than with the backend \"cpu\"",
        adapter.name
    );
    Chosen {
        report: Backend {
            name: "gpu".into(),
            adapter: Some(adapter.name.clone()),
            adapter_kind: Some(adapter.kind.to_string()),
            driver: Some(format!("{}, {}", adapter.api, adapter.driver)),
            threads: 1,
            reason: reason.into(),
        },
        place: Place::Gpu(device),
        note: (adapter.kind == AdapterKind::Software).then_some(note),
    }
}

/// The same GPU, open.
pub(super) fn kept_open(device: Device) -> Result<Device, Error> {
    open(&device).map(Device::Opened)
}

/// Opens the GPU, with timestamps if it has them, for the times of the cost report.
pub(super) fn open(device: &Device) -> Result<Gpu, Error> {
    Ok(match device {
        Device::Opened(gpu) => gpu.clone(),
        Device::Adapter(index) => Gpu::open(&GpuOptions {
            select: Select::Index(*index),
            timestamps: true,
            ..GpuOptions::default()
        })?,
    })
}

/// Positions of vertices that stay on a GPU: x, y, z in local meters.
pub(crate) struct DevicePositions(Buffer<[f32; 4]>);

impl DevicePositions {
    /// Copies positions on the GPU and appends further positions from the host.
    ///
    /// # Errors
    /// [`GpuError`] if the GPU has too little memory or is lost.
    pub(crate) fn copy(
        gpu: &Gpu,
        positions: &Buffer<[f32; 4]>,
        further: &[Point3<f32>],
    ) -> Result<Self, GpuError> {
        let count = positions.len();
        let all = gpu.zeroed("positions after the run", count + further.len())?;
        let further: Vec<[f32; 4]> = further.iter().map(|p| [p.x, p.y, p.z, 0.0]).collect();
        gpu.write(&all, count, &further)?;
        let mut pass = gpu.pass("copy positions");
        pass.copy(positions, 0..count, &all, 0);
        pass.submit()?;
        Ok(Self(all))
    }

    /// The same positions, followed by further positions that are uploaded.
    ///
    /// # Errors
    /// [`Error::Gpu`] if the GPU has too little memory or is lost.
    pub(crate) fn with(&self, gpu: &Gpu, further: &[Point3<f32>]) -> Result<Self, Error> {
        Ok(Self::copy(gpu, &self.0, further)?)
    }
}

/// A GPU on which a search for the state of rest solves its equations.
pub(crate) struct RestDevice(RestGpu);

impl RestDevice {
    /// Compiles the kernels.
    ///
    /// # Errors
    /// [`Error::Gpu`] if the GPU is lost.
    pub(crate) fn new(gpu: &Gpu) -> Result<Self, Error> {
        Ok(Self(RestGpu::new(gpu)?))
    }

    /// Memory on the device of a search with so many vertices that can move, bytes.
    pub(crate) fn bytes(vertices: usize) -> usize {
        vertices * RestGpu::BYTES_PER_VERTEX
    }

    /// The same body, whose searches solve their equations here.
    pub(crate) fn with(&self, body: cutis_rest::Body) -> cutis_rest::Body {
        body.on_gpu(&self.0)
    }
}

/// Resamples on a GPU. With `positions` the deformed positions of the warp are not uploaded.
pub(super) fn resample(
    gpu: &Gpu,
    volume: &Volume,
    warp: &Warp<'_>,
    positions: Option<&DevicePositions>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<(Volume, ResampleReport), ResampleError> {
    let Some(DevicePositions(positions)) = positions else {
        return resample_gpu(gpu, volume, warp, progress);
    };
    let mut resampler = ResamplerGpu::new(gpu, volume, warp, &ResamplerOptions::default())?;
    resampler.resample_device(positions)?;
    Ok((resampler.volume(progress)?, resampler.report()?))
}

/// True if a stage failed because memory was short or the GPU was lost. False for a faulty kernel.
pub(super) fn lacks_device(error: &Error) -> bool {
    match error {
        Error::Resample(ResampleError::TooLarge { .. }) => true,
        Error::Resample(ResampleError::Gpu(e)) | Error::Render(RenderError::Gpu(e)) => {
            matches!(
                e,
                GpuError::Limit { .. }
                    | GpuError::OutOfMemory { .. }
                    | GpuError::Lost { .. }
                    | GpuError::Wait { .. }
                    | GpuError::Readback { .. }
            )
        }
        _ => false,
    }
}

/// Whether the last pass has timestamps.
pub(super) fn has_timestamps(gpu: &Gpu) -> bool {
    gpu.last_pass_ns().is_ok_and(|ns| ns.is_some())
}

pub(super) fn work(gpu: &Gpu) -> DeviceWork {
    let counted = gpu.counters();
    DeviceWork {
        kernels: counted.kernels,
        submits: counted.submits,
        dispatches: counted.dispatches,
        readbacks: counted.readbacks,
        readback_bytes: counted.readback_bytes,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_that_does_not_fit_is_bad_input_and_a_failing_device_is_not() {
        let adapter = || "Card".to_owned();
        let memory = GpuError::OutOfMemory { what: "vertices".into(), bytes: 1 << 40 };
        let limit = GpuError::Limit { what: "vertices".into(), needed: 2, available: 1, adapter: adapter() };
        for error in [memory, limit, GpuError::Device { adapter: adapter(), reason: "busy".into() }] {
            let error = Error::Gpu(error);
            assert!(error.is_bad_input() && error.to_string().contains("\"cpu\""), "{error}");
        }
        let shader = GpuError::Shader { label: "stc".into(), message: "line 1".into() };
        let lost = GpuError::Lost { adapter: adapter(), reason: "reset".into() };
        let wait = GpuError::Wait { adapter: adapter(), reason: "time out".into() };
        for error in [shader, lost, wait] {
            assert!(!Error::Gpu(error).is_bad_input());
        }
    }

    #[test]
    fn a_stage_moves_to_the_cpu_for_a_failing_device_and_not_for_a_faulty_kernel() {
        let wait = GpuError::Wait { adapter: "Card".into(), reason: "time out".into() };
        let read = GpuError::Readback { what: "buffer 'image'".into(), reason: "unmapped".into() };
        for error in [wait, read] {
            assert!(lacks_device(&Error::Resample(ResampleError::Gpu(error.clone()))), "{error}");
            assert!(lacks_device(&Error::Render(RenderError::Gpu(error.clone()))), "{error}");
        }
        let shader = GpuError::Shader { label: "trace".into(), message: "line 1".into() };
        assert!(!lacks_device(&Error::Render(RenderError::Gpu(shader))));
    }
}
