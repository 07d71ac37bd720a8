//! GPUs: which adapter a scene means, which there are, and opening one.

use cutis_chainmail::{Chain, ChainError};
use cutis_gpu::{Adapter, AdapterKind, GpuError, GpuOptions, Select, adapters};
use cutis_render::RenderError;
use cutis_resample::ResampleError;
use cutis_solver::{Settings, System};
use cutis_solver_gpu::{GpuSolverError, SolverGpu};

use super::auto::{self, Verdict, select};
use super::{Chosen, Metered, Place, Running, Work};
use crate::backend::devices::{Device as Listed, DeviceLimits};
use crate::report::{Backend, DeviceWork, MemoryPart};
use crate::scene::LoadedScene;
use crate::{Devices, Error};

pub(crate) use cutis_chainmail::RelaxGpu as Relaxer;
pub(crate) use cutis_gpu::Gpu;
pub(super) use cutis_render::raymarch_gpu as raymarch;
pub(super) use cutis_resample::resample_gpu as resample;

/// Why there is no GPU: this build has the backend.
pub(crate) const ABSENT: Option<&str> = None;

/// Which device to use.
pub(super) enum Device {
    /// To be opened: its index in [`adapters`].
    Adapter(usize),
    /// Opened by the caller.
    Opened(Gpu),
}

/// The GPU that a scene asks for by `backend = "gpu"`.
pub(super) fn asked_for(loaded: &LoadedScene, reason: &str) -> Result<Chosen, Error> {
    let all = adapters();
    let adapter = wanted(loaded).among(&all).map_err(|e| refused(loaded, e))?;
    Ok(chosen(adapter, Device::Adapter(adapter.index), reason))
}

/// A device that the caller opened.
pub(super) fn opened(gpu: &Gpu) -> Chosen {
    chosen(gpu.adapter(), Device::Opened(gpu.clone()), "the caller opened it")
}

/// What `auto` takes.
pub(super) fn auto(loaded: &LoadedScene, work: &Work) -> Result<Chosen, Error> {
    let verdict = auto::weigh(work, loaded.scene.solver.adapter.as_deref(), adapters);
    Ok(match verdict.map_err(|e| refused(loaded, e))? {
        Verdict::Cpu(reason) => Chosen::cpu(loaded, &format!("auto: {reason}")),
        Verdict::Gpu(adapter, reason) => {
            chosen(&adapter, Device::Adapter(adapter.index), &format!("auto: {reason}"))
        }
    })
}

/// What there is; each adapter is opened once.
pub(super) fn devices() -> Devices {
    let all = adapters();
    let devices: Vec<Listed> = all.iter().map(listed).collect();
    let (auto, note) = taken_by_auto(&all, &devices);
    Devices { gpu_backend: true, auto, note, devices }
}

/// The adapter that `auto` takes for a scene that is large enough, marked only if it was opened, and what to say of it.
fn taken_by_auto(all: &[Adapter], listed: &[Listed]) -> (Option<usize>, String) {
    let Some(first) = all.first() else {
        return (None, format!("\"auto\" takes the CPU backend: {}", GpuError::NoAdapter));
    };
    let Some((adapter, device)) =
        all.iter().zip(listed).find(|(adapter, _)| auto::objection(adapter).is_none())
    else {
        let why = auto::objection(first).unwrap_or_default();
        return (None, format!("\"auto\" takes the CPU backend: {why}"));
    };
    match &device.why {
        None => {
            (Some(adapter.index), format!("\"auto\" takes {} for a scene that is large enough", adapter.name))
        }
        Some(why) => {
            let note = format!(
                "\"auto\" takes {} for a scene that is large enough, and fails: {why}; name another with --adapter, or \
                 use \"cpu\"",
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

fn wanted(loaded: &LoadedScene) -> Select {
    select(loaded.scene.solver.adapter.as_deref())
}

fn refused(loaded: &LoadedScene, error: GpuError) -> Error {
    let (key, why) = match &error {
        GpuError::NoAdapter => ("solver.backend", format!("{error}; or use \"cpu\" or \"auto\"")),
        _ => ("solver.adapter", format!("{error}; `cutis devices` tells more about them")),
    };
    loaded.blame(key)(Error::Backend { backend: "gpu".into(), why })
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

pub(super) fn memory(_: &Device, system: &System<f32>, settings: &Settings) -> Vec<MemoryPart> {
    cutis_solver_gpu::device_bytes(system, settings).iter().map(MemoryPart::from).collect()
}

/// The same, opened.
pub(super) fn kept_open(device: Device) -> Result<Device, Error> {
    open(&device).map(Device::Opened)
}

/// Opens the device.
pub(super) fn open(device: &Device) -> Result<Gpu, Error> {
    Ok(match device {
        Device::Opened(gpu) => gpu.clone(),
        Device::Adapter(index) => {
            Gpu::open(&GpuOptions { select: Select::Index(*index), ..GpuOptions::default() })?
        }
    })
}

/// Opens the device, uploads the body and compiles the kernels that it needs.
pub(super) fn start(device: &Device, system: System<f32>, settings: Settings) -> Result<Running, Error> {
    let gpu = open(device)?;
    let before = work(&gpu);
    let solver = SolverGpu::new(&gpu, system, settings).map_err(|e| match e {
        GpuSolverError::Solver(e) => Error::Solver(e),
        GpuSolverError::Gpu(e) => Error::Gpu(e),
        other => Error::Backend { backend: "gpu".into(), why: other.to_string() },
    })?;
    Ok(Running { solver: Box::new(solver), device: Some(Metered { gpu, before }) })
}

/// Opens the device and makes room for a chain.
pub(super) fn start_chain(device: &Device, chain: &Chain) -> Result<(Relaxer, Metered), Error> {
    let gpu = open(device)?;
    let before = work(&gpu);
    let relaxer = Relaxer::new(&gpu, chain).map_err(|error| match error {
        ChainError::Gpu(error) => Error::Gpu(error),
        other => Error::Chain(other),
    })?;
    Ok((relaxer, Metered { gpu, before }))
}

pub(super) fn chain_memory(_: &Device, chain: &Chain) -> Vec<MemoryPart> {
    vec![MemoryPart { part: "relaxation".into(), bytes: Relaxer::BYTES_PER_PLACE * chain.places() }]
}

/// Whether a stage failed for want of room or of the device, as against a fault of a kernel.
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
    fn what_does_not_fit_is_the_scene_s_fault_and_what_fails_the_device_s() {
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
    fn a_stage_does_without_a_device_that_fails_and_not_without_a_kernel_that_is_wrong() {
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
