//! Counts of what a device did: tests hold a frame to one submission and no readback with them.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// What a [`Gpu`](crate::Gpu) did since it was opened, over all its handles and threads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Kernels compiled.
    pub kernels: u64,
    /// Buffers made, uniforms included.
    pub buffers: u64,
    /// Bytes of the buffers that live now (the staging buffer of reads excluded).
    pub buffer_bytes: u64,
    /// Textures made.
    pub textures: u64,
    /// Bytes of the textures that live now.
    pub texture_bytes: u64,
    /// Passes submitted.
    pub submits: u64,
    /// Dispatches in the submitted passes.
    pub dispatches: u64,
    /// Calls of `write` (the contents that a buffer is made with are not counted).
    pub writes: u64,
    /// Calls of `read`.
    pub readbacks: u64,
    /// Bytes that `read` returned.
    pub readback_bytes: u64,
}

/// The counters behind the snapshot.
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
    /// The counts now.
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

/// Memory of the device, counted as live until the last holder goes: a buffer or texture, and the groups that bind it.
#[derive(Debug)]
pub(crate) struct Memory {
    tally: Arc<Tally>,
    bytes: u64,
    live: fn(&Tally) -> &AtomicU64,
}

impl Memory {
    /// Counts `bytes` in the counter that `live` names.
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
