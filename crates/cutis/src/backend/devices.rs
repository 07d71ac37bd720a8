//! `cutis devices`: the GPUs of this machine, whether they can be used, and the one that `auto`
//! selects.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::gpu;

/// The GPUs of this machine.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Devices {
    /// Whether this build has a GPU backend. A build without one looks for no devices.
    pub gpu_backend: bool,
    /// Best hardware first, software last.
    pub devices: Vec<Device>,
    /// Index of the GPU that `backend = "auto"` selects for a large scene; none if it selects the
    /// CPU backend.
    pub auto: Option<usize>,
    /// The choice of `auto` with its reason, or the software to install.
    pub note: String,
}

/// One adapter.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Device {
    /// Index, which `--adapter` accepts. It accepts a part of the name as well.
    pub index: usize,
    /// Name that the driver gives it.
    pub name: String,
    /// `discrete`, `integrated`, `virtual`, `unknown` or `software`.
    pub kind: String,
    /// `vulkan`, `metal` or `dx12`.
    pub api: String,
    /// Name and version of the driver.
    pub driver: String,
    /// Limits of the adapter.
    pub limits: DeviceLimits,
    /// Whether it could be opened.
    pub usable: bool,
    /// Why it could not be opened.
    pub why: Option<String>,
}

/// Limits that matter to large bodies.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct DeviceLimits {
    /// Largest buffer, bytes.
    pub max_buffer_bytes: u64,
    /// Largest part of a buffer that a kernel sees, bytes: 16 of them per vertex.
    pub max_binding_bytes: u64,
    /// Most workgroups of a dispatch.
    pub max_workgroups: u32,
    /// Largest side of a volume on the device, voxels.
    pub max_texture_3d: u32,
    /// Most buffers of a kernel.
    pub storage_buffers_per_stage: u32,
}

/// Lists the GPUs of this machine. Opens each of them once to see whether it can be used.
pub fn devices() -> Devices {
    gpu::devices()
}
