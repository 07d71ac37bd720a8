//! The adapters of the machine and their order.

use std::{fmt, sync::LazyLock};

use crate::{GpuError, Limits, Select, limits};

/// One adapter of the machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Adapter {
    /// Index in the order of [`adapters`]: best hardware first, software last.
    pub index: usize,
    /// Name of the adapter, as given by the driver.
    pub name: String,
    /// The type of the adapter.
    pub kind: AdapterKind,
    /// The graphics API of the adapter: `"vulkan"`, `"metal"` or `"dx12"`.
    pub api: &'static str,
    /// Name and version of the driver.
    pub driver: String,
    /// The limits of a device of this adapter, unless it is opened with baseline limits.
    pub limits: Limits,
    /// True if the adapter can time its work.
    pub timestamps: bool,
    /// The limit of WebGPU's baseline that the adapter does not reach, so that it cannot be opened.
    /// `None` if it reaches all limits.
    pub lacking: Option<String>,
}

/// The type of an adapter, from best to worst.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum AdapterKind {
    /// A GPU with its own memory.
    Discrete,
    /// A GPU that shares the memory of the CPU.
    Integrated,
    /// A GPU of a virtual machine.
    Virtual,
    /// The driver does not report the type.
    Unknown,
    /// A software implementation that runs on the CPU.
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

/// Lists the adapters of this machine without duplicates, best hardware first and software last.
/// The list is empty if there is no driver. No device is opened.
pub fn adapters() -> Vec<Adapter> {
    enumerate().into_iter().map(|(adapter, _)| adapter).collect()
}

/// Lists the adapters with their wgpu handles.
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

/// Returns the adapter that `select` selects.
pub(crate) fn choose(select: &Select) -> Result<(Adapter, wgpu::Adapter), GpuError> {
    let mut all = enumerate();
    let described: Vec<Adapter> = all.iter().map(|(adapter, _)| adapter.clone()).collect();
    let index = select.among(&described)?.index;
    Ok(all.swap_remove(index))
}

/// Returns the instance of the process. There is only one, so that wgpu can detect a resource of
/// one device that is used with another. `None` if this build supports no graphics API of the
/// platform.
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

/// Returns the rank and the name of a graphics API.
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

/// True if two entries are the same hardware with two graphics APIs or two drivers. The PCI address
/// distinguishes cards. Without it, entries of the same name are one adapter only if their APIs
/// differ or if they are software, so that two equal cards remain two.
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
    fn one_card_with_two_apis_is_one_adapter_and_two_cards_are_two() {
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
    fn hardware_is_listed_before_software() {
        use AdapterKind::*;
        let mut kinds = [Software, Unknown, Virtual, Integrated, Discrete];
        kinds.sort();
        assert_eq!(kinds, [Discrete, Integrated, Virtual, Unknown, Software]);
    }
}
