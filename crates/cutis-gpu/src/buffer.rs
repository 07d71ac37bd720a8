//! Typed memory of the device: making it and writing to it.

use std::{fmt, marker::PhantomData, ops::Range, sync::Arc};

use bytemuck::Pod;

use crate::{
    Binding, Gpu, GpuError,
    counters::{Memory, add},
};

/// Copies to and from buffers move whole words of 4 bytes.
pub(crate) const WORD: u64 = 4;

/// Large contents go up in parts of this many bytes, so that no second copy of them has to fit in memory.
pub(crate) const PART: usize = 16 << 20;

/// `len` elements of `T` on the device. The memory goes when the buffer and the bind groups made with it are dropped, and the
/// device has done what was submitted with them.
pub struct Buffer<T> {
    pub(crate) raw: wgpu::Buffer,
    pub(crate) label: String,
    len: usize,
    memory: Arc<Memory>,
    element: PhantomData<fn(T) -> T>,
}

impl Gpu {
    /// A storage buffer with these contents, for kernels to read and write.
    ///
    /// An empty slice gets the memory of one zeroed element, so that it can be bound; its length is 0.
    ///
    /// # Errors
    ///
    /// [`GpuError::Limit`] beyond the largest buffer, [`GpuError::OutOfMemory`], [`GpuError::Lost`].
    pub fn buffer<T: Pod>(&self, label: &str, contents: &[T]) -> Result<Buffer<T>, GpuError> {
        let buffer = self.zeroed(label, contents.len())?;
        self.upload(&buffer, 0, contents)?;
        Ok(buffer)
    }

    /// A storage buffer of `len` elements, every byte 0.
    ///
    /// # Errors
    ///
    /// As [`Gpu::buffer`].
    pub fn zeroed<T: Pod>(&self, label: &str, len: usize) -> Result<Buffer<T>, GpuError> {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        self.allocate(label, len, usage, self.limits().max_buffer_bytes)
    }

    /// A uniform buffer with this value: parameters that every thread of a kernel reads.
    ///
    /// # Errors
    ///
    /// As [`Gpu::buffer`]; a value may have 64 KiB on any device.
    pub fn uniform<T: Pod>(&self, label: &str, value: &T) -> Result<Buffer<T>, GpuError> {
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let buffer = self.allocate(label, 1, usage, self.shared.max_uniform_bytes)?;
        self.upload(&buffer, 0, std::slice::from_ref(value))?;
        Ok(buffer)
    }

    /// Writes `data` from element `offset` on. It takes effect before any pass that is submitted afterwards.
    ///
    /// # Errors
    ///
    /// [`GpuError::Range`] when the data do not fit in; [`GpuError::Alignment`] when they do not begin on a multiple of
    /// 4 bytes, or neither end on one nor at the end of the buffer (both can only happen where `T` is smaller than 4
    /// bytes); [`GpuError::Lost`].
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

    /// Sends what was written on its way and waits for it, which frees the memory in between.
    pub(crate) fn flush(&self, what: &impl Fn() -> String) -> Result<(), GpuError> {
        let sent = self.checked(|fault| fault.of(what(), 0), || self.shared.queue.submit([]))?;
        self.poll(wgpu::PollType::Wait { submission_index: Some(sent), timeout: None })
    }
}

impl<T> Buffer<T> {
    /// All of it, to bind to a kernel.
    pub fn whole(&self) -> Binding<'_> {
        Binding::buffer(&self.raw, &self.memory, &self.label, 0..self.bytes())
    }

    /// These elements, to bind to a kernel. The first must lie on a multiple of 256 bytes; whether it does, and whether
    /// the range lies within the buffer, is checked by [`Gpu::bind`].
    pub fn range(&self, range: Range<usize>) -> Binding<'_> {
        match self.bytes_of(|| format!("binding buffer '{}'", self.label), range.clone()) {
            Ok(bytes) if bytes.end > bytes.start => {
                let end = if range.end == self.len { self.bytes() } else { bytes.end };
                Binding::buffer(&self.raw, &self.memory, &self.label, bytes.start..end)
            }
            _ => Binding::outside(&self.label, range, self.len),
        }
    }

    /// Elements.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether it has no elements.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Bytes on the device: those of the elements, padded to a multiple of 4, and never none.
    pub fn bytes(&self) -> u64 {
        self.raw.size()
    }

    /// The bytes of a range of elements.
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

    /// The same bytes up to a whole word, where that takes in nothing but padding.
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
