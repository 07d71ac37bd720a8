//! The adapters of the machine: their order, their names and the choice of one.

use std::{convert::Infallible, fmt, str::FromStr, sync::LazyLock};

use crate::{GpuError, Limits, limits};

/// One adapter that can be opened.
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

/// Which adapter to open.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Select {
    /// The first of [`adapters`]: the best hardware, a software adapter if there is nothing else.
    #[default]
    First,
    /// The adapter with this [`Adapter::index`].
    Index(usize),
    /// The first adapter whose name has this part, upper or lower case alike.
    Name(String),
}

impl Select {
    /// The one of `adapters`, as [`adapters`](fn@adapters) lists them, that is meant.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`] if there is none at all, [`GpuError::NoSuchAdapter`] if none of them is meant.
    pub fn among<'a>(&self, adapters: &'a [Adapter]) -> Result<&'a Adapter, GpuError> {
        if adapters.is_empty() {
            return Err(GpuError::NoAdapter);
        }
        let found = match self {
            Select::First => adapters.first(),
            Select::Index(index) => adapters.get(*index),
            Select::Name(part) => {
                let part = part.to_lowercase();
                adapters.iter().find(|adapter| adapter.name.to_lowercase().contains(&part))
            }
        };
        found.ok_or_else(|| GpuError::NoSuchAdapter {
            asked: self.to_string(),
            found: adapters.iter().map(|adapter| format!("{}: {}", adapter.index, adapter.name)).collect(),
        })
    }
}

impl FromStr for Select {
    type Err = Infallible;

    /// A number is an index, `first` is the first, anything else a part of a name.
    fn from_str(text: &str) -> Result<Select, Infallible> {
        let text = text.trim();
        Ok(match text.parse() {
            Ok(index) => Select::Index(index),
            Err(_) if text.eq_ignore_ascii_case("first") => Select::First,
            Err(_) => Select::Name(text.to_owned()),
        })
    }
}

impl fmt::Display for Select {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Select::First => f.write_str("first"),
            Select::Index(index) => write!(f, "{index}"),
            Select::Name(part) => f.write_str(part),
        }
    }
}

/// The adapters of this machine that can be opened, each once, best hardware first and software last. No device is
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
    Adapter {
        index,
        name: info.name,
        kind: kind(info.device_type),
        api: api(info.backend).1,
        driver: [info.driver, info.driver_info].join(" ").trim().to_owned(),
        limits: Limits::of(&limits::requested(&offered, false).unwrap_or(offered)),
        timestamps: handle.features().contains(wgpu::Features::TIMESTAMP_QUERY),
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

    fn adapter(index: usize, name: &str) -> Adapter {
        Adapter {
            index,
            name: name.to_owned(),
            kind: AdapterKind::Discrete,
            api: "vulkan",
            driver: String::new(),
            limits: Limits::of(&wgpu::Limits::default()),
            timestamps: false,
        }
    }

    #[test]
    fn an_adapter_is_chosen_by_order_index_and_part_of_the_name() {
        let all = [adapter(0, "Fast Card 9000"), adapter(1, "llvmpipe (LLVM)")];
        let chosen = |text: &str| text.parse::<Select>().unwrap().among(&all).map(|adapter| adapter.index);
        assert_eq!(chosen("first"), Ok(0));
        assert_eq!(chosen("1"), Ok(1));
        assert_eq!(chosen("LLVMPIPE"), Ok(1));
        assert_eq!(chosen("a"), Ok(0), "the first of several");
        for missing in ["2", "other card"] {
            let error = chosen(missing).unwrap_err().to_string();
            assert_eq!(
                error,
                format!("no GPU adapter '{missing}'; there is: 0: Fast Card 9000, 1: llvmpipe (LLVM)")
            );
        }
        assert_eq!(Select::Index(0).among(&[]), Err(GpuError::NoAdapter));
        assert!(GpuError::NoAdapter.to_string().contains("mesa-vulkan-drivers"));
    }

    #[test]
    fn a_choice_is_written_as_it_is_read() {
        for select in [Select::First, Select::Index(3), Select::Name("radeon".to_owned())] {
            assert_eq!(select.to_string().parse(), Ok(select));
        }
    }

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
