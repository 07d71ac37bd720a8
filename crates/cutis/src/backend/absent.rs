//! A build without the feature `gpu`: a GPU is refused by name, and `auto` takes the CPU and says why.

use cutis_chainmail::{Chain, ChainError, Relaxation};
use cutis_render::{Image, RenderError, View};
use cutis_resample::{ResampleError, ResampleReport, Warp};
use cutis_solver::{Settings, System};
use cutis_volume::Volume;

use super::{Chosen, Metered, Running, Work};
use crate::report::{DeviceWork, MemoryPart};
use crate::scene::LoadedScene;
use crate::{Devices, Error};

/// Why there is no GPU.
pub(crate) const ABSENT: Option<&str> = Some("this build has no GPU backend");

/// No device: there is none to be had.
#[derive(Clone)]
pub(crate) enum Gpu {}

/// No adapter: there is none to be had.
pub(super) enum Device {}

pub(super) fn asked_for(loaded: &LoadedScene, _: &str) -> Result<Chosen, Error> {
    let why = "this build has no GPU backend; use \"cpu\" or \"auto\"".into();
    Err(loaded.blame("solver.backend")(Error::Backend { backend: "gpu".into(), why }))
}

pub(super) fn auto(loaded: &LoadedScene, _: &Work) -> Result<Chosen, Error> {
    Ok(Chosen::cpu(loaded, "auto: this build has no GPU backend"))
}

pub(super) fn devices() -> Devices {
    Devices {
        gpu_backend: false,
        devices: Vec::new(),
        auto: None,
        note: "this build has no GPU backend (feature `gpu`): \"auto\" takes the CPU backend".into(),
    }
}

pub(super) fn memory(device: &Device, _: &System<f32>, _: &Settings) -> Vec<MemoryPart> {
    match *device {}
}

pub(super) fn kept_open(device: Device) -> Result<Device, Error> {
    match device {}
}

pub(super) fn open(device: &Device) -> Result<Gpu, Error> {
    match *device {}
}

pub(super) fn start(device: &Device, _: System<f32>, _: Settings) -> Result<Running, Error> {
    match *device {}
}

/// Relaxation on no device.
pub(crate) enum Relaxer {}

impl Relaxer {
    pub(crate) fn relax(&mut self, _: &mut Chain, _: u32, _: &[u32]) -> Result<Relaxation, ChainError> {
        match *self {}
    }
}

pub(super) fn start_chain(device: &Device, _: &Chain) -> Result<(Relaxer, Metered), Error> {
    match *device {}
}

pub(super) fn chain_memory(device: &Device, _: &Chain) -> Vec<MemoryPart> {
    match *device {}
}

pub(super) fn resample(
    gpu: &Gpu,
    _: &Volume,
    _: &Warp<'_>,
    _: &(dyn Fn(usize, usize) + Sync),
) -> Result<(Volume, ResampleReport), ResampleError> {
    match *gpu {}
}

pub(super) fn raymarch(gpu: &Gpu, _: &Volume, _: &View<'_>) -> Result<Image, RenderError> {
    match *gpu {}
}

pub(super) fn lacks_device(_: &Error) -> bool {
    false
}

pub(super) fn work(gpu: &Gpu) -> DeviceWork {
    match *gpu {}
}
