//! GPUs: which adapter a scene means, when `auto` takes one, and opening it.

use cutis_gpu::{Adapter, AdapterKind, GpuError, GpuOptions, Select, adapters};
use cutis_render::RenderError;
use cutis_resample::ResampleError;
use cutis_solver::{Settings, System, Vertex};
use cutis_solver_gpu::{GpuSolverError, SolverGpu};

use super::{Chosen, Metered, Place, Running, Work};
use crate::devices::{Device as Listed, DeviceLimits};
use crate::report::{Backend, DeviceWork, MemoryPart};
use crate::scene::LoadedScene;
use crate::{Devices, Error};

pub(crate) use cutis_gpu::Gpu;
pub(super) use cutis_render::raymarch_gpu as raymarch;
pub(super) use cutis_resample::resample_gpu as resample;

/// Why there is no GPU: this build has the backend.
pub(crate) const ABSENT: Option<&str> = None;

/// Constraints of a colour, on average, from which `auto` takes a GPU of its own memory.
///
/// A colour is one dispatch, and colours run one after the other. What a dispatch costs before it computes anything (launch,
/// and the barrier to the one before) is of the order of 10 µs on a GPU; the CPU backend projects about 40 constraints per
/// microsecond and core (the demo on two cores: 57 million projections in 0.7 s). With fewer constraints than
/// 40 × 10 µs × cores, several thousand on a common machine, the CPU is done before a GPU has begun; and a large GPU needs
/// some ten thousand threads at once to be busy. This is an estimate: no hardware GPU was at hand to measure it.
const MIN_CONSTRAINTS_PER_SWEEP: u64 = 16_384;

/// Projections of a run from which `auto` takes a GPU: a second or two on the CPU backend with two cores. Opening a device,
/// compiling kernels and uploading the body costs a part of a second, which a shorter run never earns back. An estimate too.
const MIN_PROJECTIONS: u64 = 100_000_000;

/// How many times as many constraints `auto` asks for before it takes a GPU that shares the memory of the CPU: projections
/// wait for memory rather than for arithmetic, and there both wait for the same. An estimate too.
const SHARED_MEMORY_FACTOR: u64 = 4;

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
    let verdict = weigh(work, loaded.scene.solver.adapter.as_deref(), adapters);
    Ok(match verdict.map_err(|e| refused(loaded, e))? {
        Verdict::Cpu(reason) => Chosen::cpu(loaded, &format!("auto: {reason}")),
        Verdict::Gpu(adapter, reason) => {
            chosen(&adapter, Device::Adapter(adapter.index), &format!("auto: {reason}"))
        }
    })
}

/// What there is; each adapter is opened once.
pub(crate) fn devices() -> Devices {
    let all = adapters();
    let auto = all.iter().find(|adapter| objection(adapter).is_none());
    let note = match (auto, all.first()) {
        (Some(adapter), _) => format!("\"auto\" takes {} for a scene that is large enough", adapter.name),
        (None, Some(first)) => {
            let why = objection(first).unwrap_or_default();
            format!("\"auto\" takes the CPU backend: {why}")
        }
        (None, None) => format!("\"auto\" takes the CPU backend: {}", GpuError::NoAdapter),
    };
    Devices {
        gpu_backend: true,
        auto: auto.map(|adapter| adapter.index),
        note,
        devices: all.iter().map(listed).collect(),
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

fn select(adapter: Option<&str>) -> Select {
    adapter.map_or(Select::First, |text| text.parse().unwrap_or_else(|never| match never {}))
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

/// What `auto` decides, and why.
#[derive(Debug, PartialEq)]
enum Verdict {
    Cpu(String),
    Gpu(Adapter, String),
}

/// Decides for `auto`; `adapters` is called only if the work is large enough for any of them.
fn weigh(
    work: &Work,
    adapter: Option<&str>,
    adapters: impl FnOnce() -> Vec<Adapter>,
) -> Result<Verdict, GpuError> {
    let per_sweep = work.constraints / work.sweeps.max(1);
    if per_sweep < MIN_CONSTRAINTS_PER_SWEEP {
        return Ok(Verdict::Cpu(format!(
            "{per_sweep} constraints of a colour are too few for a GPU, which pays from about {MIN_CONSTRAINTS_PER_SWEEP}"
        )));
    }
    if work.projections < MIN_PROJECTIONS {
        let millions = |n: u64| n as f64 / 1e6;
        return Ok(Verdict::Cpu(format!(
            "{:.1} million projections are too short a run for a GPU, which pays from about {:.0} million",
            millions(work.projections),
            millions(MIN_PROJECTIONS)
        )));
    }
    let all = adapters();
    let candidates = match adapter {
        Some(_) => vec![select(adapter).among(&all)?],
        None => all.iter().collect(),
    };
    let mut first_objection = None;
    for adapter in candidates {
        match objection(adapter).or_else(|| too_small_for(adapter, work, per_sweep)) {
            Some(why) => first_objection = first_objection.or(Some(why)),
            None => {
                let reason = format!("{per_sweep} constraints of a colour keep a {} GPU busy", adapter.kind);
                return Ok(Verdict::Gpu(adapter.clone(), reason));
            }
        }
    }
    Ok(Verdict::Cpu(first_objection.unwrap_or_else(|| "there is no GPU adapter".into())))
}

/// Why `auto` does not take an adapter, whatever the scene.
fn objection(adapter: &Adapter) -> Option<String> {
    match adapter.kind {
        AdapterKind::Discrete | AdapterKind::Integrated | AdapterKind::Virtual => None,
        AdapterKind::Software => {
            Some(format!("{} is a software device, slower than the backend \"cpu\"", adapter.name))
        }
        AdapterKind::Unknown => {
            Some(format!("the driver does not say what kind of device {} is", adapter.name))
        }
    }
}

/// Why `auto` does not take an adapter for this scene.
fn too_small_for(adapter: &Adapter, work: &Work, per_sweep: u64) -> Option<String> {
    let pays_from = MIN_CONSTRAINTS_PER_SWEEP * SHARED_MEMORY_FACTOR;
    if adapter.kind == AdapterKind::Integrated && per_sweep < pays_from {
        return Some(format!(
            "{per_sweep} constraints of a colour are too few for {}, which shares the processor's memory and pays from \
             about {pays_from}",
            adapter.name
        ));
    }
    let vertex_bytes = work.vertices.saturating_mul(size_of::<Vertex<f32>>() as u64);
    (vertex_bytes > adapter.limits.max_binding_bytes).then(|| {
        format!(
            "the vertices take {vertex_bytes} bytes, and {} binds at most {}",
            adapter.name, adapter.limits.max_binding_bytes
        )
    })
}

pub(super) fn memory(_: &Device, system: &System<f32>, settings: &Settings) -> Vec<MemoryPart> {
    cutis_solver_gpu::device_bytes(system, settings).iter().map(MemoryPart::from).collect()
}

/// Opens the device, uploads the body and compiles the kernels that it needs.
pub(super) fn start(device: &Device, system: System<f32>, settings: Settings) -> Result<Running, Error> {
    let gpu = match device {
        Device::Opened(gpu) => gpu.clone(),
        Device::Adapter(index) => {
            Gpu::open(&GpuOptions { select: Select::Index(*index), ..GpuOptions::default() })?
        }
    };
    let before = work(&gpu);
    let solver = SolverGpu::new(&gpu, system, settings).map_err(|e| match e {
        GpuSolverError::Solver(e) => Error::Solver(e),
        GpuSolverError::Gpu(e) => Error::Gpu(e),
        other => Error::Backend { backend: "gpu".into(), why: other.to_string() },
    })?;
    Ok(Running { solver: Box::new(solver), device: Some(Metered { gpu, before }) })
}

/// Whether a stage failed for want of room or of the device, as against a fault of a kernel.
pub(super) fn lacks_device(error: &Error) -> bool {
    match error {
        Error::Resample(ResampleError::TooLarge { .. }) => true,
        Error::Resample(ResampleError::Gpu(e)) | Error::Render(RenderError::Gpu(e)) => {
            matches!(e, GpuError::Limit { .. } | GpuError::OutOfMemory { .. } | GpuError::Lost { .. })
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
    use cutis_gpu::Limits;

    use super::*;

    const LARGE: Work =
        Work { vertices: 1 << 20, constraints: 10_000_000, sweeps: 50, projections: 10_000_000_000 };

    fn adapter(index: usize, name: &str, kind: AdapterKind) -> Adapter {
        let limits = Limits {
            max_buffer_bytes: 256 << 20,
            max_binding_bytes: 128 << 20,
            max_workgroups: 65_535,
            max_texture_3d: 2048,
            storage_buffers_per_stage: 8,
        };
        Adapter {
            index,
            name: name.into(),
            kind,
            api: "vulkan",
            driver: "test".into(),
            limits,
            timestamps: false,
        }
    }

    /// The index of the adapter that is taken, or why it is the CPU.
    fn verdict(work: Work, asked: Option<&str>, all: &[Adapter]) -> Result<usize, String> {
        match weigh(&work, asked, || all.to_vec()).unwrap() {
            Verdict::Gpu(adapter, _) => Ok(adapter.index),
            Verdict::Cpu(why) => Err(why),
        }
    }

    #[test]
    fn auto_takes_the_first_hardware_that_a_large_scene_can_fill() {
        use AdapterKind::*;
        let card = adapter(0, "Card", Discrete);
        let chip = adapter(1, "Chip", Integrated);
        let lent = adapter(0, "Lent", Virtual);
        assert_eq!(verdict(LARGE, None, &[card.clone(), chip.clone()]), Ok(0));
        assert_eq!(verdict(LARGE, Some("chip"), &[card.clone(), chip.clone()]), Ok(1));
        assert_eq!(verdict(LARGE, None, std::slice::from_ref(&lent)), Ok(0));

        // A scene that keeps a card busy, but not a chip that shares the memory of the CPU.
        let middle = Work { constraints: 20_000 * 50, ..LARGE };
        assert_eq!(verdict(middle, None, &[card, chip.clone()]), Ok(0));
        let why = verdict(middle, Some("1"), &[lent, chip]).unwrap_err();
        assert!(why.contains("Chip") && why.contains("65536"), "{why}");
    }

    #[test]
    fn auto_never_takes_software_nor_what_it_does_not_know() {
        let software = adapter(1, "llvmpipe", AdapterKind::Software);
        let unknown = adapter(0, "mystery", AdapterKind::Unknown);
        for (all, asked, word) in [
            (vec![], None, "no GPU adapter"),
            (vec![software.clone()], None, "software"),
            (vec![unknown.clone(), software.clone()], None, "mystery"),
            (vec![unknown, software], Some("llvm"), "software"),
        ] {
            let why = verdict(LARGE, asked, &all).unwrap_err();
            assert!(why.contains(word), "{why}");
        }
    }

    #[test]
    fn auto_looks_for_no_adapter_if_the_scene_is_too_small() {
        let looked = || -> Vec<Adapter> { panic!("looked for adapters") };
        for (work, word) in [
            (Work { constraints: 16_383 * 50, ..LARGE }, "16383 constraints"),
            (Work { constraints: 0, sweeps: 0, ..LARGE }, "0 constraints"),
            (Work { projections: 99_000_000, ..LARGE }, "99.0 million"),
        ] {
            let Ok(Verdict::Cpu(why)) = weigh(&work, Some("unheard-of"), looked) else { panic!("{work:?}") };
            assert!(why.contains(word), "{why}");
        }
    }

    #[test]
    fn auto_passes_by_what_cannot_hold_the_vertices() {
        let card = adapter(0, "Card", AdapterKind::Discrete);
        let most = card.limits.max_binding_bytes / 16;
        assert_eq!(verdict(Work { vertices: most, ..LARGE }, None, std::slice::from_ref(&card)), Ok(0));
        let why = verdict(Work { vertices: most + 1, ..LARGE }, None, &[card]).unwrap_err();
        assert!(why.contains("Card") && why.contains("134217728"), "{why}");
    }

    #[test]
    fn an_adapter_that_is_named_and_not_there_is_refused() {
        let all = || vec![adapter(0, "Card", AdapterKind::Discrete)];
        let error = weigh(&LARGE, Some("other"), all).unwrap_err();
        assert!(matches!(error, GpuError::NoSuchAdapter { .. }), "{error}");
    }

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
        for error in [shader, GpuError::Lost { adapter: adapter(), reason: "reset".into() }] {
            assert!(!Error::Gpu(error).is_bad_input());
        }
    }
}
