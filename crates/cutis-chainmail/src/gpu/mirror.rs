//! Memory of the device that goes up again only where it changed.

use bytemuck::Pod;
use cutis_gpu::{Buffer, Gpu, GpuError};

/// A buffer, and what was last written to it.
pub struct Mirror<T> {
    pub buffer: Buffer<T>,
    written: Vec<T>,
    /// A write failed, so that nobody knows what the device has.
    failed: bool,
}

impl<T: Pod + PartialEq> Mirror<T> {
    /// `len` elements, every byte 0.
    pub fn new(gpu: &Gpu, label: &str, len: usize) -> Result<Self, GpuError> {
        Ok(Self { buffer: gpu.zeroed(label, len)?, written: vec![T::zeroed(); len], failed: false })
    }

    /// Has `contents` from element `offset` on, up to the end.
    pub fn set(&mut self, gpu: &Gpu, offset: usize, contents: &[T]) -> Result<(), GpuError> {
        let written = &mut self.written[offset..offset + contents.len()];
        if !self.failed && written == contents {
            return Ok(());
        }
        written.copy_from_slice(contents);
        let done = gpu.write(&self.buffer, offset, contents);
        self.failed |= done.is_err();
        done
    }

    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        self.buffer.bytes()
    }
}
