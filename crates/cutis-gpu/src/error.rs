//! What can go wrong on a GPU.

use thiserror::Error;

/// Why a call to the GPU failed. Messages name the adapter, buffer or kernel and say what would be right.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum GpuError {
    /// The machine offers no adapter.
    #[error(
        "no GPU adapter found: install the driver of your graphics card, or a software one \
         (Debian and Ubuntu: apt-get install mesa-vulkan-drivers libvulkan1)"
    )]
    NoAdapter,
    /// There are adapters, but not the one that was asked for.
    #[error("no GPU adapter '{asked}'; there is: {}", found.join(", "))]
    NoSuchAdapter {
        /// The name or index that was asked for.
        asked: String,
        /// The adapters that can be opened, each as `index: name`.
        found: Vec<String>,
    },
    /// The adapter was there, but gave no device.
    #[error("cannot open the GPU '{adapter}': {reason}")]
    Device {
        /// Name of the adapter.
        adapter: String,
        /// The driver's reason.
        reason: String,
    },
    /// More was asked for than the device offers.
    #[error("{what}: {needed} needed, the GPU '{adapter}' offers {available}")]
    Limit {
        /// What the limit is on, and which.
        what: String,
        /// What was asked for.
        needed: u64,
        /// What the device offers.
        available: u64,
        /// Name of the adapter.
        adapter: String,
    },
    /// A kernel was refused by the shader compiler.
    #[error("kernel '{label}': {message}")]
    Shader {
        /// The kernel's label.
        label: String,
        /// The compiler's message, with the line of the source.
        message: String,
    },
    /// A call broke a rule of the GPU.
    #[error("{what}: {message}")]
    Validation {
        /// What was called, and on what.
        what: String,
        /// The rule that was broken.
        message: String,
    },
    /// A range does not lie within its buffer.
    #[error("{what}: {start}..{end} lies outside of 0..{len}, or is empty where it may not be")]
    Range {
        /// What was called, and on what.
        what: String,
        /// First element asked for.
        start: usize,
        /// End of the elements asked for.
        end: usize,
        /// Elements that there are.
        len: usize,
    },
    /// A range of bytes does not start or end where the GPU needs it.
    #[error("{what}: byte {offset} is not a multiple of {multiple}")]
    Alignment {
        /// What was called, and on what.
        what: String,
        /// The byte in question.
        offset: u64,
        /// What it should be a multiple of.
        multiple: u64,
    },
    /// The device has no memory left.
    #[error("{what}: the GPU has no room for {bytes} bytes")]
    OutOfMemory {
        /// What the memory was for.
        what: String,
        /// How much was asked for.
        bytes: u64,
    },
    /// The device is gone: the driver was reset, the card removed, or the device destroyed.
    #[error("the GPU '{adapter}' was lost: {reason}")]
    Lost {
        /// Name of the adapter.
        adapter: String,
        /// The driver's reason.
        reason: String,
    },
    /// The driver could not wait for work that was submitted.
    #[error("waiting for the GPU '{adapter}' failed: {reason}")]
    Wait {
        /// Name of the adapter.
        adapter: String,
        /// The driver's reason.
        reason: String,
    },
    /// Memory of the device could not be mapped for reading.
    #[error("cannot read {what} back from the GPU: {reason}")]
    Readback {
        /// What was read.
        what: String,
        /// Why it failed.
        reason: String,
    },
}
