//! The adapters of the machine: what they are and in which order they stand.

use std::{fmt, sync::LazyLock};

use crate::{GpuError, Limits, Select, limits};

/// One adapter of the machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Adapter {
    /// Place in the order of [`adapters`]: best hardware first, software last.
    pub index: usize,
    /// The driver's name of the adapter.
    pub name: String,
    /// What sort of adapter it is.
    pub kind: AdapterKind,
    /// The interface that it is reached by: `"vulkan"`, `"metal"` or `"dx12"`.
    pub api: &'static str,
    /// Name and version of the driver.
    pub driver: String,
    /// What a device of it offers, unless only the baseline is asked for.
    pub limits: Limits,
    /// Whether it can time its work.
    pub timestamps: bool,
    /// Why it cannot be opened: the limit of WebGPU's baseline that it does not reach. None: it reaches them all.
    pub lacking: Option<String>,
}

/// What sort of adapter it is, from best to last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum AdapterKind {
    /// A card with its own memory.
    Discrete,
    /// A GPU that shares the memory of the CPU.
    Integrated,
    /// A GPU lent to a virtual machine.
    Virtual,
    /// The driver does not say.
    Unknown,
    /// No GPU: the CPU computes.
    Software,
}

impl fmt::Display for AdapterKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            AdapterKind::Discrete => "discrete",
            AdapterKind::Integrated => "integrated",
            AdapterKind::Virtual => "virtual",
            AdapterKind::Unknown => "unknown",
            AdapterKind::Software => "software",
        })
    }
}

/// The adapters of this machine, each once, best hardware first and software last. No device is
/// made. Empty when there is no driver.
pub fn adapters() -> Vec<Adapter> {
    enumerate().into_iter().map(|(adapter, _)| adapter).collect()
}

/// The adapters with wgpu's handles.
pub(crate) fn enumerate() -> Vec<(Adapter, wgpu::Adapter)> {
    let Some(instance) = instance() else { return Vec::new() };
    let mut found: Vec<_> = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()))
        .into_iter()
        .map(|handle| (handle.get_info(), handle))
        .collect();
    found.sort_by_cached_key(|(info, _)| {
        (kind(info.device_type), api(info.backend).0, info.device_pci_bus_id.clone(), info.name.clone())
    });
    let mut once: Vec<(wgpu::AdapterInfo, wgpu::Adapter)> = Vec::with_capacity(found.len());
    for (info, handle) in found {
        if !once.iter().any(|(other, _)| same_adapter(other, &info)) {
            once.push((info, handle));
        }
    }
    once.into_iter()
        .enumerate()
        .map(|(index, (info, handle))| (describe(index, info, &handle), handle))
        .collect()
}

/// The adapter that `select` means.
pub(crate) fn choose(select: &Select) -> Result<(Adapter, wgpu::Adapter), GpuError> {
    let mut all = enumerate();
    let described: Vec<Adapter> = all.iter().map(|(adapter, _)| adapter.clone()).collect();
    let place = select.among(&described)?.index;
    Ok(all.swap_remove(place))
}

/// One instance for the whole process, so that a resource of one device given to another is told apart by wgpu. None
/// when no interface of this platform is built in.
fn instance() -> Option<&'static wgpu::Instance> {
    static INSTANCE: LazyLock<Option<wgpu::Instance>> = LazyLock::new(|| {
        (!wgpu::Instance::enabled_backend_features().is_empty()).then(|| {
            wgpu::Instance::new(wgpu::InstanceDescriptor {
                flags: wgpu::InstanceFlags::empty().with_env(),
                ..wgpu::InstanceDescriptor::new_without_display_handle()
            })
        })
    });
    INSTANCE.as_ref()
}

fn describe(index: usize, info: wgpu::AdapterInfo, handle: &wgpu::Adapter) -> Adapter {
    let offered = handle.limits();
    let (limits, lacking) = match limits::requested(&offered, false) {
        Ok(limits) => (limits, None),
        Err(shortfall) => (offered, Some(shortfall.to_string())),
    };
    Adapter {
        index,
        name: info.name,
        kind: kind(info.device_type),
        api: api(info.backend).1,
        driver: [info.driver, info.driver_info].join(" ").trim().to_owned(),
        limits: Limits::of(&limits),
        timestamps: handle.features().contains(wgpu::Features::TIMESTAMP_QUERY),
        lacking,
    }
}

fn kind(device_type: wgpu::DeviceType) -> AdapterKind {
    match device_type {
        wgpu::DeviceType::DiscreteGpu => AdapterKind::Discrete,
        wgpu::DeviceType::IntegratedGpu => AdapterKind::Integrated,
        wgpu::DeviceType::VirtualGpu => AdapterKind::Virtual,
        wgpu::DeviceType::Cpu => AdapterKind::Software,
        wgpu::DeviceType::Other => AdapterKind::Unknown,
    }
}

/// Rank and name of an interface.
fn api(backend: wgpu::Backend) -> (u8, &'static str) {
    match backend {
        wgpu::Backend::Vulkan => (0, "vulkan"),
        wgpu::Backend::Metal => (1, "metal"),
        wgpu::Backend::Dx12 => (2, "dx12"),
        wgpu::Backend::Gl => (3, "gl"),
        wgpu::Backend::BrowserWebGpu => (4, "webgpu"),
        wgpu::Backend::Noop => (5, "none"),
    }
}

/// Whether two entries mean the same piece of hardware, reached by two interfaces or two drivers. The place on the bus
/// tells cards apart; where it is not given, equal names are the same adapter only across interfaces or in software
/// (two equal cards stay two).
fn same_adapter(a: &wgpu::AdapterInfo, b: &wgpu::AdapterInfo) -> bool {
    if (kind(a.device_type), a.vendor, a.device) != (kind(b.device_type), b.vendor, b.device) {
        return false;
    }
    if !a.device_pci_bus_id.is_empty() && !b.device_pci_bus_id.is_empty() {
        return a.device_pci_bus_id == b.device_pci_bus_id;
    }
    a.name == b.name && (a.backend != b.backend || kind(a.device_type) == AdapterKind::Software)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_ways_to_one_card_are_one_adapter_and_two_cards_are_two() {
        let info = |backend, device_type, bus: &str| wgpu::AdapterInfo {
            device_pci_bus_id: bus.to_owned(),
            name: "card".to_owned(),
            ..wgpu::AdapterInfo::new(device_type, backend)
        };
        use wgpu::{Backend::*, DeviceType::*};
        let card = info(Vulkan, DiscreteGpu, "0000:01:00.0");
        assert!(same_adapter(&card, &info(Dx12, DiscreteGpu, "0000:01:00.0")));
        assert!(same_adapter(&card, &info(Dx12, DiscreteGpu, "")));
        assert!(!same_adapter(&card, &info(Vulkan, DiscreteGpu, "0000:02:00.0")));
        assert!(!same_adapter(&info(Metal, DiscreteGpu, ""), &info(Metal, DiscreteGpu, "")));
        assert!(same_adapter(&info(Vulkan, Cpu, ""), &info(Vulkan, Cpu, "")));
        assert!(!same_adapter(&card, &info(Vulkan, Cpu, "")));
    }

    #[test]
    fn hardware_comes_before_software() {
        use AdapterKind::*;
        let mut kinds = [Software, Unknown, Virtual, Integrated, Discrete];
        kinds.sort();
        assert_eq!(kinds, [Discrete, Integrated, Virtual, Unknown, Software]);
    }
}
