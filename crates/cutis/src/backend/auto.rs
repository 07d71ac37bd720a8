//! When `auto` takes a GPU: by the size of the work and the kind of device, and only then by looking what there is.

use cutis_gpu::{Adapter, AdapterKind, GpuError, Select};
use cutis_solver::Vertex;

use super::Work;

/// Constraints of a color, on average, or vertices in vertex block descent, from which `auto` takes a GPU of its own memory.
///
/// A color is one dispatch, and colors run one after the other. What a dispatch costs before it computes anything (launch,
/// and the barrier to the one before) is of the order of 10 µs on a GPU; the CPU backend projects about 40 constraints per
/// microsecond and core (the demo on two cores: 57 million projections in 0.7 s). With fewer constraints than
/// 40 × 10 µs × cores, several thousand on a common machine, the CPU is done before a GPU has begun; and a large GPU needs
/// some ten thousand threads at once to be busy. This is an estimate: no hardware GPU was at hand to measure it.
/// A vertex has several ten constraints to evaluate, so that the CPU would be done later; a GPU needs as many threads to be busy.
const MIN_PER_SWEEP: u64 = 16_384;

/// Constraints that a run evaluates from which `auto` takes a GPU, one in each projection: a second or two on the CPU backend with two cores. Opening a device,
/// compiling kernels and uploading the body costs a part of a second, which a shorter run never earns back. An estimate too.
const MIN_EVALUATIONS: u64 = 100_000_000;

/// How many times as many constraints `auto` asks for before it takes a GPU that shares the memory of the CPU: projections
/// wait for memory rather than for arithmetic, and there both wait for the same. An estimate too.
const SHARED_MEMORY_FACTOR: u64 = 4;

/// What `auto` decides, and why.
#[derive(Debug, PartialEq)]
pub(super) enum Verdict {
    Cpu(String),
    Gpu(Adapter, String),
}

/// Decides for `auto`; `adapters` is called only if the work is large enough for any of them.
pub(super) fn weigh(
    work: &Work,
    adapter: Option<&str>,
    adapters: impl FnOnce() -> Vec<Adapter>,
) -> Result<Verdict, GpuError> {
    let element = work.element;
    let per_sweep = work.elements / work.sweeps.max(1);
    if per_sweep < MIN_PER_SWEEP {
        return Ok(Verdict::Cpu(format!(
            "{per_sweep} {element} of a color are too few for a GPU, which pays from about {MIN_PER_SWEEP}"
        )));
    }
    if work.evaluations < MIN_EVALUATIONS {
        let millions = |n: u64| n as f64 / 1e6;
        return Ok(Verdict::Cpu(format!(
            "{:.1} million evaluations of a constraint are too short a run for a GPU, which pays from about {:.0} million",
            millions(work.evaluations),
            millions(MIN_EVALUATIONS)
        )));
    }
    let all = adapters();
    let candidates = match adapter {
        Some(_) if !all.is_empty() => vec![select(adapter).among(&all)?],
        _ => all.iter().collect(),
    };
    let mut first_objection = None;
    for adapter in candidates {
        match objection(adapter).or_else(|| too_small_for(adapter, work, per_sweep)) {
            Some(why) => first_objection = first_objection.or(Some(why)),
            None => {
                let reason = format!("{per_sweep} {element} of a color keep a {} GPU busy", adapter.kind);
                return Ok(Verdict::Gpu(adapter.clone(), reason));
            }
        }
    }
    Ok(Verdict::Cpu(first_objection.unwrap_or_else(|| "there is no GPU adapter".into())))
}

/// Why `auto` does not take an adapter, whatever the scene.
pub(super) fn objection(adapter: &Adapter) -> Option<String> {
    if let Some(lacking) = &adapter.lacking {
        return Some(format!("{} cannot be opened: {lacking}", adapter.name));
    }
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
    let pays_from = MIN_PER_SWEEP * SHARED_MEMORY_FACTOR;
    if adapter.kind == AdapterKind::Integrated && per_sweep < pays_from {
        return Some(format!(
            "{per_sweep} {} of a color are too few for {}, which shares the processor's memory and pays from about \
             {pays_from}",
            work.element, adapter.name
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

/// The adapter that a scene names; the best one if it names none.
pub(super) fn select(adapter: Option<&str>) -> Select {
    adapter.map_or(Select::First, |text| text.parse().unwrap_or_else(|never| match never {}))
}

#[cfg(test)]
mod tests {
    use cutis_gpu::Limits;

    use super::*;

    const LARGE: Work = Work {
        vertices: 1 << 20,
        element: "constraints",
        elements: 10_000_000,
        sweeps: 50,
        projections: 10_000_000_000,
        evaluations: 10_000_000_000,
    };

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
            lacking: None,
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
        let middle = Work { elements: 20_000 * 50, ..LARGE };
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
            (vec![], Some("nvidia"), "no GPU adapter"),
            (vec![software.clone()], None, "software"),
            (vec![unknown.clone(), software.clone()], None, "mystery"),
            (vec![unknown, software], Some("llvm"), "software"),
        ] {
            let why = verdict(LARGE, asked, &all).unwrap_err();
            assert!(why.contains(word), "{why}");
        }
    }

    #[test]
    fn auto_passes_by_what_cannot_be_opened() {
        let lacking = Some("WebGPU's baseline limit max_bind_groups: 4 needed, 2 offered".to_owned());
        let old = Adapter { lacking, ..adapter(0, "Old", AdapterKind::Discrete) };
        let chip = adapter(1, "Chip", AdapterKind::Integrated);
        assert_eq!(verdict(LARGE, None, &[old.clone(), chip.clone()]), Ok(1));
        let why = verdict(LARGE, Some("old"), &[old, chip]).unwrap_err();
        assert!(why.contains("Old") && why.contains("max_bind_groups"), "{why}");
    }

    #[test]
    fn auto_looks_for_no_adapter_if_the_scene_is_too_small() {
        let looked = || -> Vec<Adapter> { panic!("looked for adapters") };
        for (work, word) in [
            (Work { elements: 16_383 * 50, ..LARGE }, "16383 constraints"),
            (Work { element: "vertices", elements: 16_383 * 50, ..LARGE }, "16383 vertices"),
            (Work { elements: 0, sweeps: 0, ..LARGE }, "0 constraints"),
            (Work { evaluations: 99_000_000, ..LARGE }, "99.0 million"),
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
}
