//! `cutis devices`: the GPUs of this machine, which of them can be used, and which one `auto` takes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::gpu;

/// The GPUs of this machine.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Devices {
    /// Whether this build has a GPU backend; without it nobody looks for devices.
    pub gpu_backend: bool,
    /// Best hardware first, software last.
    pub devices: Vec<Device>,
    /// Index of the one that `backend = "auto"` takes for a scene that is large enough; none: it takes the CPU backend.
    pub auto: Option<usize>,
    /// What `auto` does, in words, or what to install.
    pub note: String,
}

/// One adapter.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Device {
    /// What `--adapter` takes, beside a part of the name.
    pub index: usize,
    /// The driver's name of it.
    pub name: String,
    /// `discrete`, `integrated`, `virtual`, `unknown` or `software`.
    pub kind: String,
    /// `vulkan`, `metal` or `dx12`.
    pub api: String,
    /// Name and version of the driver.
    pub driver: String,
    /// What it offers.
    pub limits: DeviceLimits,
    /// Whether it was opened just now.
    pub usable: bool,
    /// Why not.
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

/// Looks for GPUs and opens each of them once, to see whether it can be used.
pub fn devices() -> Devices {
    gpu::devices()
}
