//! Errors of GPU calls.

use thiserror::Error;

/// An error of a GPU call. Messages name the adapter, buffer or kernel.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum GpuError {
    /// The machine has no adapter.
    #[error(
        "no GPU adapter found: install the driver of your graphics card, or a software one \
         (Debian and Ubuntu: apt-get install mesa-vulkan-drivers libvulkan1)"
    )]
    NoAdapter,
    /// The selected adapter does not exist.
    #[error("no GPU adapter '{asked}'; expected one of: {}", found.join(", "))]
    NoSuchAdapter {
        /// The requested name or index.
        asked: String,
        /// The existing adapters, each as `index: name`.
        found: Vec<String>,
    },
    /// The adapter exists, but its device cannot be opened.
    #[error("cannot open the GPU '{adapter}': {reason}")]
    Device {
        /// Name of the adapter.
        adapter: String,
        /// The reason given by the driver.
        reason: String,
    },
    /// A size exceeds a limit of the device.
    #[error("{what}: {needed} needed, the GPU '{adapter}' offers {available}")]
    Limit {
        /// The size and the object that it belongs to.
        what: String,
        /// The needed value.
        needed: u64,
        /// The limit of the device.
        available: u64,
        /// Name of the adapter.
        adapter: String,
    },
    /// The shader compiler rejected a kernel.
    #[error("kernel '{label}': {message}")]
    Shader {
        /// Label of the kernel.
        label: String,
        /// Message of the compiler, with the line of the source.
        message: String,
    },
    /// A call violated a rule of the GPU.
    #[error("{what}: {message}")]
    Validation {
        /// The call and its object.
        what: String,
        /// The violated rule.
        message: String,
    },
    /// A range exceeds its buffer, or is empty where this is not allowed.
    #[error("{what}: {start}..{end} is not a range within 0..{len}, or is empty where this is not allowed")]
    Range {
        /// The call and its object.
        what: String,
        /// First element of the range.
        start: usize,
        /// End of the range.
        end: usize,
        /// Number of elements of the buffer.
        len: usize,
    },
    /// A range of bytes does not start or end at a multiple that the GPU requires.
    #[error("{what}: byte {offset} is not a multiple of {multiple}")]
    Alignment {
        /// The call and its object.
        what: String,
        /// The start or end of the range.
        offset: u64,
        /// The required multiple.
        multiple: u64,
    },
    /// The device has no memory left.
    #[error("{what}: the GPU has no room for {bytes} bytes")]
    OutOfMemory {
        /// The object that needed memory.
        what: String,
        /// The needed memory.
        bytes: u64,
    },
    /// The device was lost: the driver was reset, the card removed, or the device destroyed.
    #[error("the GPU '{adapter}' was lost: {reason}")]
    Lost {
        /// Name of the adapter.
        adapter: String,
        /// The reason given by the driver.
        reason: String,
    },
    /// The driver could not wait for submitted work.
    #[error("waiting for the GPU '{adapter}' failed: {reason}")]
    Wait {
        /// Name of the adapter.
        adapter: String,
        /// The reason given by the driver.
        reason: String,
    },
    /// Device memory could not be mapped for a readback.
    #[error("cannot read {what} back from the GPU: {reason}")]
    Readback {
        /// The buffer.
        what: String,
        /// The error of the mapping.
        reason: String,
    },
}
