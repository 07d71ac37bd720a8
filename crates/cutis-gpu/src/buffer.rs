//! Typed buffers on the device: allocation and upload.

use std::{fmt, marker::PhantomData, ops::Range, sync::Arc};

use bytemuck::Pod;

use crate::{
    Binding, Gpu, GpuError,
    counters::{Memory, add},
};

/// Copies to and from buffers consist of whole words of 4 bytes.
pub(crate) const WORD: u64 = 4;

/// Size of a part of an upload in bytes. Large contents are uploaded in parts, so that memory does
/// not have to hold a second complete copy.
pub(crate) const PART: usize = 16 << 20;

/// A buffer of `len` elements of `T` on the device. Its memory is freed when the buffer and the
/// bind groups with it are dropped and the device has finished the work that uses them.
pub struct Buffer<T> {
    pub(crate) raw: wgpu::Buffer,
    pub(crate) label: String,
    len: usize,
    memory: Arc<Memory>,
    element: PhantomData<fn(T) -> T>,
}

impl Gpu {
    /// Creates a storage buffer with the given contents, which kernels can read and write.
    ///
    /// A buffer with no elements has the memory of one zeroed element, so that it can be bound.
    ///
    /// # Errors
    ///
    /// Returns [`GpuError::Limit`] if the contents exceed the largest buffer,
    /// [`GpuError::OutOfMemory`] or [`GpuError::Lost`].
    pub fn buffer<T: Pod>(&self, label: &str, contents: &[T]) -> Result<Buffer<T>, GpuError> {
        let buffer = self.zeroed(label, contents.len())?;
        self.upload(&buffer, 0, contents)?;
        Ok(buffer)
    }

    /// Creates a storage buffer of `len` elements with all bytes 0.
    ///
    /// # Errors
    ///
    /// Returns the errors of [`Gpu::buffer`].
    pub fn zeroed<T: Pod>(&self, label: &str, len: usize) -> Result<Buffer<T>, GpuError> {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        self.allocate(label, len, usage, self.limits().max_buffer_bytes)
    }

    /// Creates a uniform buffer with the given value, for parameters that every thread of a kernel
    /// reads.
    ///
    /// # Errors
    ///
    /// Returns the errors of [`Gpu::buffer`]. On every device a value may have up to 64 KiB.
    pub fn uniform<T: Pod>(&self, label: &str, value: &T) -> Result<Buffer<T>, GpuError> {
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let buffer = self.allocate(label, 1, usage, self.shared.max_uniform_bytes)?;
        self.upload(&buffer, 0, std::slice::from_ref(value))?;
        Ok(buffer)
    }

    /// Writes `data` to the elements from `offset` on. The write takes effect before every pass
    /// that is submitted later.
    ///
    /// # Errors
    ///
    /// Returns [`GpuError::Range`] if the data exceed the buffer, and [`GpuError::Lost`]. Returns
    /// [`GpuError::Alignment`] if the data do not start at a multiple of 4 bytes, or end neither at
    /// such a multiple nor at the end of the buffer. This can only happen for elements of less than
    /// 4 bytes.
    pub fn write<T: Pod>(&self, buffer: &Buffer<T>, offset: usize, data: &[T]) -> Result<(), GpuError> {
        self.upload(buffer, offset, data)?;
        add(&self.shared.tally.writes, 1);
        Ok(())
    }

    fn allocate<T: Pod>(
        &self,
        label: &str,
        len: usize,
        usage: wgpu::BufferUsages,
        most: u64,
    ) -> Result<Buffer<T>, GpuError> {
        let what = || format!("buffer '{label}' of {len} elements");
        let asked = (len.max(1) as u64).checked_mul(size_of::<T>() as u64);
        let size = asked.and_then(|bytes| bytes.max(WORD).checked_next_multiple_of(WORD));
        let Some(size) = size.filter(|size| *size <= most) else {
            self.alive()?;
            return Err(self.over_limit(format!("bytes of {}", what()), asked.unwrap_or(u64::MAX), most));
        };
        let descriptor =
            wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false };
        let raw =
            self.checked(|fault| fault.of(what(), size), || self.shared.device.create_buffer(&descriptor))?;
        add(&self.shared.tally.buffers, 1);
        let memory = Memory::new(&self.shared.tally, size, |tally| &tally.buffer_bytes);
        Ok(Buffer { raw, label: label.to_owned(), len, memory, element: PhantomData })
    }

    fn upload<T: Pod>(&self, buffer: &Buffer<T>, offset: usize, data: &[T]) -> Result<(), GpuError> {
        let what = || format!("writing to buffer '{}'", buffer.label);
        let range = buffer.bytes_of(what, offset..offset.saturating_add(data.len()))?;
        buffer.words_of(what, &range)?;
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let whole = bytes.len() - bytes.len() % WORD as usize;
        let (words, tail) = bytes.split_at(whole);
        let queue = &self.shared.queue;
        for (index, part) in words.chunks(PART).enumerate() {
            let at = range.start + (index * PART) as u64;
            self.checked(
                |fault| fault.of(what(), part.len() as u64),
                || queue.write_buffer(&buffer.raw, at, part),
            )?;
            if part.len() == PART {
                self.flush(&what)?;
            }
        }
        if !tail.is_empty() {
            let mut word = [0; WORD as usize];
            word[..tail.len()].copy_from_slice(tail);
            let at = range.start + whole as u64;
            self.checked(|fault| fault.of(what(), WORD), || queue.write_buffer(&buffer.raw, at, &word))?;
        }
        self.alive()
    }

    /// Submits all writes and waits for them, which frees wgpu's staging memory.
    pub(crate) fn flush(&self, what: &impl Fn() -> String) -> Result<(), GpuError> {
        let sent = self.checked(|fault| fault.of(what(), 0), || self.shared.queue.submit([]))?;
        self.poll(wgpu::PollType::Wait { submission_index: Some(sent), timeout: None })
    }
}

impl<T> Buffer<T> {
    /// Returns a binding of the whole buffer.
    pub fn whole(&self) -> Binding<'_> {
        Binding::buffer(&self.raw, &self.memory, &self.label, 0..self.bytes())
    }

    /// Returns a binding of a range of elements. The first element must start at a multiple of 256
    /// bytes. [`Gpu::bind`] checks this, and that the range is within the buffer.
    pub fn range(&self, range: Range<usize>) -> Binding<'_> {
        match self.bytes_of(|| format!("binding buffer '{}'", self.label), range.clone()) {
            Ok(bytes) if bytes.end > bytes.start => {
                let end = if range.end == self.len { self.bytes() } else { bytes.end };
                Binding::buffer(&self.raw, &self.memory, &self.label, bytes.start..end)
            }
            _ => Binding::outside(&self.label, range, self.len),
        }
    }

    /// Returns the number of elements.
    pub fn len(&self) -> usize {
        self.len
    }

    /// True if the buffer has no elements.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Returns the memory on the device in bytes: the size of the elements, padded to a multiple of
    /// 4, and never 0.
    pub fn bytes(&self) -> u64 {
        self.raw.size()
    }

    /// Returns the bytes of a range of elements.
    pub(crate) fn bytes_of(
        &self,
        what: impl Fn() -> String,
        range: Range<usize>,
    ) -> Result<Range<u64>, GpuError> {
        if range.start > range.end || range.end > self.len {
            return Err(GpuError::Range { what: what(), start: range.start, end: range.end, len: self.len });
        }
        let size = size_of::<T>() as u64;
        Ok(range.start as u64 * size..range.end as u64 * size)
    }

    /// Extends a range of bytes to a whole word if the extension contains only padding.
    pub(crate) fn words_of(
        &self,
        what: impl Fn() -> String,
        bytes: &Range<u64>,
    ) -> Result<Range<u64>, GpuError> {
        let inner_end = bytes.end != self.len as u64 * size_of::<T>() as u64;
        let wrong = [(true, bytes.start), (inner_end, bytes.end)]
            .into_iter()
            .find(|(must, offset)| *must && bytes.start < bytes.end && !offset.is_multiple_of(WORD));
        match wrong {
            Some((_, offset)) => Err(GpuError::Alignment { what: what(), offset, multiple: WORD }),
            None => Ok(bytes.start..bytes.end.next_multiple_of(WORD)),
        }
    }
}

impl<T> fmt::Debug for Buffer<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Buffer").field("label", &self.label).field("len", &self.len).finish_non_exhaustive()
    }
}
