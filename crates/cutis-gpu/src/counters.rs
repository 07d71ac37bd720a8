//! Counters of the work of a device. Tests use them to check the submissions and readbacks of a
//! frame.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Work of a [`Gpu`](crate::Gpu) since it was opened, over all its handles and threads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Compiled kernels.
    pub kernels: u64,
    /// Created buffers, including uniforms.
    pub buffers: u64,
    /// Bytes of all existing buffers, without the staging buffer of readbacks.
    pub buffer_bytes: u64,
    /// Created textures.
    pub textures: u64,
    /// Bytes of all existing textures.
    pub texture_bytes: u64,
    /// Submitted passes.
    pub submits: u64,
    /// Dispatches in the submitted passes.
    pub dispatches: u64,
    /// Calls of `write`. The initial contents of a buffer do not count.
    pub writes: u64,
    /// Calls of `read`.
    pub readbacks: u64,
    /// Bytes returned by `read`.
    pub readback_bytes: u64,
}

/// The atomic counters behind [`Counters`].
#[derive(Debug, Default)]
pub(crate) struct Tally {
    pub(crate) kernels: AtomicU64,
    pub(crate) buffers: AtomicU64,
    pub(crate) buffer_bytes: AtomicU64,
    pub(crate) textures: AtomicU64,
    pub(crate) texture_bytes: AtomicU64,
    pub(crate) submits: AtomicU64,
    pub(crate) dispatches: AtomicU64,
    pub(crate) writes: AtomicU64,
    pub(crate) readbacks: AtomicU64,
    pub(crate) readback_bytes: AtomicU64,
}

impl Tally {
    /// Returns the present counts.
    pub(crate) fn snapshot(&self) -> Counters {
        Counters {
            kernels: self.kernels.load(Relaxed),
            buffers: self.buffers.load(Relaxed),
            buffer_bytes: self.buffer_bytes.load(Relaxed),
            textures: self.textures.load(Relaxed),
            texture_bytes: self.texture_bytes.load(Relaxed),
            submits: self.submits.load(Relaxed),
            dispatches: self.dispatches.load(Relaxed),
            writes: self.writes.load(Relaxed),
            readbacks: self.readbacks.load(Relaxed),
            readback_bytes: self.readback_bytes.load(Relaxed),
        }
    }
}

/// Adds to a counter.
pub(crate) fn add(counter: &AtomicU64, amount: u64) {
    counter.fetch_add(amount, Relaxed);
}

/// Memory of a buffer or texture. It counts as existing until the resource and all bind groups with
/// it are dropped.
#[derive(Debug)]
pub(crate) struct Memory {
    tally: Arc<Tally>,
    bytes: u64,
    live: fn(&Tally) -> &AtomicU64,
}

impl Memory {
    /// Adds `bytes` to the counter that `live` selects.
    pub(crate) fn new(tally: &Arc<Tally>, bytes: u64, live: fn(&Tally) -> &AtomicU64) -> Arc<Self> {
        add(live(tally), bytes);
        Arc::new(Self { tally: Arc::clone(tally), bytes, live })
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        (self.live)(&self.tally).fetch_sub(self.bytes, Relaxed);
    }
}
