//! A device buffer that is written only where its contents changed.

use bytemuck::Pod;
use cutis_gpu::{Buffer, Gpu, GpuError};

/// A buffer and a host copy of what was last written to it.
pub struct Mirror<T> {
    pub buffer: Buffer<T>,
    written: Vec<T>,
    /// A write failed, so that the contents of the device are unknown.
    failed: bool,
}

impl<T: Pod + PartialEq> Mirror<T> {
    /// A buffer of `len` elements whose bytes are 0.
    pub fn new(gpu: &Gpu, label: &str, len: usize) -> Result<Self, GpuError> {
        Ok(Self { buffer: gpu.zeroed(label, len)?, written: vec![T::zeroed(); len], failed: false })
    }

    /// Writes `contents` at element `offset`, unless the device has them already.
    pub fn set(&mut self, gpu: &Gpu, offset: usize, contents: &[T]) -> Result<(), GpuError> {
        let written = &mut self.written[offset..offset + contents.len()];
        if !self.failed && written == contents {
            return Ok(());
        }
        written.copy_from_slice(contents);
        let result = gpu.write(&self.buffer, offset, contents);
        self.failed |= result.is_err();
        result
    }

    /// Size on the device in bytes.
    pub fn bytes(&self) -> u64 {
        self.buffer.bytes()
    }
}
