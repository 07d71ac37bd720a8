//! A build without the feature `gpu`: a scene that names a GPU is refused, and `auto` uses the CPU
//! and says why.

use cutis_render::{Image, RenderError, View};
use cutis_resample::{ResampleError, ResampleReport, Warp};
use cutis_volume::Volume;
use nalgebra::Point3;

use super::{Chosen, Work};
use crate::output::report::DeviceWork;
use crate::scene::{SceneFile, SolverSection};
use crate::{Devices, Error};

/// The reason why there is no GPU.
pub(crate) const ABSENT: Option<&str> = Some("this build has no GPU backend");

/// An open GPU. No value of this type exists.
#[derive(Clone)]
pub(crate) enum Gpu {}

/// The GPU to use. No value of this type exists.
pub(super) enum Device {}

/// Positions on a GPU. No value of this type exists.
pub(crate) enum DevicePositions {}

impl DevicePositions {
    pub(crate) fn with(&self, _: &Gpu, _: &[Point3<f32>]) -> Result<Self, Error> {
        match *self {}
    }
}

/// A GPU for searches for the state of rest. No value of this type exists.
pub(crate) enum RestDevice {}

impl RestDevice {
    pub(crate) fn new(gpu: &Gpu) -> Result<Self, Error> {
        match *gpu {}
    }

    pub(crate) fn bytes(_: usize) -> usize {
        0
    }

    pub(crate) fn with(&self, _: cutis_rest::Body) -> cutis_rest::Body {
        match *self {}
    }
}

pub(super) fn named_by_scene(file: SceneFile<'_>, _: &SolverSection, _: &str) -> Result<Chosen, Error> {
    let why = "this build has no GPU backend; use \"cpu\" or \"auto\"".into();
    Err(file.blame("solver.backend")(Error::Backend { backend: "gpu".into(), why }))
}

pub(super) fn auto(_: SceneFile<'_>, solver: &SolverSection, _: &Work) -> Result<Chosen, Error> {
    Ok(Chosen::cpu(solver, "auto: this build has no GPU backend"))
}

pub(super) fn devices() -> Devices {
    Devices {
        gpu_backend: false,
        devices: Vec::new(),
        auto: None,
        note: "this build has no GPU backend (feature `gpu`): \"auto\" uses the CPU backend".into(),
    }
}

pub(super) fn kept_open(device: Device) -> Result<Device, Error> {
    match device {}
}

pub(super) fn open(device: &Device) -> Result<Gpu, Error> {
    match *device {}
}

pub(super) fn resample(
    gpu: &Gpu,
    _: &Volume,
    _: &Warp<'_>,
    _: Option<&DevicePositions>,
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

pub(super) fn has_timestamps(gpu: &Gpu) -> bool {
    match *gpu {}
}

pub(super) fn work(gpu: &Gpu) -> DeviceWork {
    match *gpu {}
}
