//! Decides when `auto` selects a GPU: first by the amount of work, then by the adapters of the
//! machine.

use cutis_gpu::{Adapter, AdapterKind, GpuError, Select};
use cutis_solver::Vertex;

use super::Work;

/// Mean number of constraints of a color (of vertices in vertex block descent) above which `auto`
/// selects a GPU with memory of its own.
///
/// A color is one dispatch, and colors run one after the other. The launch of a dispatch and the
/// barrier before it take about 10 µs on a GPU. The CPU backend projects about 40 constraints per
/// microsecond and core (the demo on two cores: 57 million projections in 0.7 s). With fewer
/// constraints than 40 × 10 µs × cores, several thousand on a common machine, the CPU ends before a
/// GPU has begun. A large GPU also needs some ten thousand threads at once to be busy. A vertex has
/// several tens of constraints, so the CPU would take longer, but a GPU needs as many threads. All
/// this is an estimate: no hardware GPU was available to measure it.
const MIN_PER_SWEEP: u64 = 16_384;

/// Number of constraint evaluations of a run above which `auto` selects a GPU: one or two seconds
/// on the CPU backend with two cores. A GPU takes part of a second to open, to compile kernels and
/// to upload the body, and a shorter run does not save that much time. This is an estimate too.
const MIN_EVALUATIONS: u64 = 100_000_000;

/// Factor on [`MIN_PER_SWEEP`] for a GPU that shares the memory of the CPU. Memory limits
/// projections more than arithmetic does, and here both processors share one memory. This is an
/// estimate too.
const SHARED_MEMORY_FACTOR: u64 = 4;

/// The decision of `auto`, with its reason.
#[derive(Debug, PartialEq)]
pub(super) enum Verdict {
    Cpu(String),
    Gpu(Adapter, String),
}

/// Decides for `auto`. `adapters` is called only if the work is large enough for a GPU.
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

/// Why `auto` never selects this adapter; none if it may.
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

/// Why `auto` does not select an adapter for this amount of work.
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

/// Selects the adapter that a scene names, or the best one.
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

    /// The index of the adapter that `auto` selects, or the reason for the CPU.
    fn verdict(work: Work, asked: Option<&str>, all: &[Adapter]) -> Result<usize, String> {
        match weigh(&work, asked, || all.to_vec()).unwrap() {
            Verdict::Gpu(adapter, _) => Ok(adapter.index),
            Verdict::Cpu(why) => Err(why),
        }
    }

    #[test]
    fn auto_selects_the_first_hardware_adapter_that_a_large_scene_can_fill() {
        use AdapterKind::*;
        let card = adapter(0, "Card", Discrete);
        let chip = adapter(1, "Chip", Integrated);
        let lent = adapter(0, "Lent", Virtual);
        assert_eq!(verdict(LARGE, None, &[card.clone(), chip.clone()]), Ok(0));
        assert_eq!(verdict(LARGE, Some("chip"), &[card.clone(), chip.clone()]), Ok(1));
        assert_eq!(verdict(LARGE, None, std::slice::from_ref(&lent)), Ok(0));

        // This scene keeps a card busy, but not a chip that shares the memory of the CPU.
        let middle = Work { elements: 20_000 * 50, ..LARGE };
        assert_eq!(verdict(middle, None, &[card, chip.clone()]), Ok(0));
        let why = verdict(middle, Some("1"), &[lent, chip]).unwrap_err();
        assert!(why.contains("Chip") && why.contains("65536"), "{why}");
    }

    #[test]
    fn auto_never_selects_a_software_or_an_unknown_adapter() {
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
    fn auto_skips_adapters_that_cannot_be_opened() {
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
    fn auto_skips_adapters_that_cannot_hold_the_vertices() {
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
