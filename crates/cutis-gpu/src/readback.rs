//! Readback of device memory through one persistent staging buffer.

use std::{ops::Range, sync::mpsc};

use bytemuck::Pod;

use crate::{Buffer, Gpu, GpuError, buffer::WORD, counters::add, device::lock};

/// Largest size of the staging buffer in bytes. Larger readbacks are split into parts.
const MAX_STAGING: u64 = 32 << 20;

/// Initial size of the staging buffer in bytes.
const MIN_STAGING: u64 = 64 << 10;

/// The staging buffer, created by the first readback.
#[derive(Default)]
pub(crate) struct Staging(Option<wgpu::Buffer>);

impl Gpu {
    /// Reads a range of elements after all submitted work. This waits for the device, so avoid it
    /// within a frame.
    ///
    /// # Errors
    ///
    /// Returns [`GpuError::Range`] if the range exceeds the buffer, [`GpuError::Readback`] if the
    /// memory cannot be mapped, [`GpuError::Validation`] for a uniform buffer, which cannot be
    /// read, and [`GpuError::Lost`].
    pub fn read<T: Pod>(&self, buffer: &Buffer<T>, range: Range<usize>) -> Result<Vec<T>, GpuError> {
        let what = || format!("reading buffer '{}'", buffer.label);
        self.alive()?;
        let bytes = buffer.bytes_of(what, range.clone())?;
        let mut elements = vec![T::zeroed(); range.len()];
        self.download(&buffer.raw, &buffer.label, bytes.start, bytemuck::cast_slice_mut(&mut elements))?;
        add(&self.shared.tally.readbacks, 1);
        add(&self.shared.tally.readback_bytes, bytes.end - bytes.start);
        Ok(elements)
    }

    /// Copies the bytes from `start` on into `into`, in parts.
    pub(crate) fn download(
        &self,
        from: &wgpu::Buffer,
        label: &str,
        start: u64,
        into: &mut [u8],
    ) -> Result<(), GpuError> {
        let mut staging = lock(&self.shared.staging);
        let end = start + into.len() as u64;
        let mut at = start;
        while at < end {
            let first = at - at % WORD;
            let last = end.next_multiple_of(WORD).min(first + MAX_STAGING);
            let stop = last.min(end);
            let part = &mut into[(at - start) as usize..(stop - start) as usize];
            if let Err(error) =
                self.download_part(&mut staging, from, label, first..last, (at - first) as usize, part)
            {
                staging.0 = None; // it may still be mapped
                return Err(error);
            }
            at = stop;
        }
        Ok(())
    }

    /// Copies the whole words `words` of `from` into `into`, without their first `skip` bytes.
    fn download_part(
        &self,
        staging: &mut Staging,
        from: &wgpu::Buffer,
        label: &str,
        words: Range<u64>,
        skip: usize,
        into: &mut [u8],
    ) -> Result<(), GpuError> {
        let size = words.end - words.start;
        let failed = |reason: String| GpuError::Readback { what: format!("buffer '{label}'"), reason };
        let target = self.staging(staging, size)?;
        let (sender, receiver) = mpsc::channel();
        let submitted = self.checked(
            |fault| fault.of(format!("reading buffer '{label}'"), size),
            || {
                let mut encoder = self.shared.device.create_command_encoder(&Default::default());
                encoder.copy_buffer_to_buffer(from, words.start, target, 0, size);
                let submitted = self.shared.queue.submit([encoder.finish()]);
                target.map_async(wgpu::MapMode::Read, 0..size, move |mapped| {
                    let _ = sender.send(mapped);
                });
                submitted
            },
        )?;
        self.poll(wgpu::PollType::Wait { submission_index: Some(submitted), timeout: None })?;
        // Another thread that polls at the same time may run the callback a moment later.
        match receiver.recv() {
            Ok(Ok(())) => {}
            Ok(Err(error)) => return Err(failed(error.to_string())),
            Err(_) => return Err(failed("the device did not answer".to_owned())),
        }
        let view = target.get_mapped_range(0..size).map_err(|error| failed(error.to_string()))?;
        into.copy_from_slice(&view[skip..skip + into.len()]);
        drop(view);
        self.checked(|fault| fault.of(format!("reading buffer '{label}'"), size), || target.unmap())
    }

    /// Returns a staging buffer of at least `size` bytes, up to the largest size.
    fn staging<'a>(&self, staging: &'a mut Staging, size: u64) -> Result<&'a wgpu::Buffer, GpuError> {
        let fitting = staging.0.take().filter(|buffer| buffer.size() >= size);
        let buffer = match fitting {
            Some(buffer) => buffer,
            None => {
                let size = size.next_power_of_two().clamp(MIN_STAGING, MAX_STAGING);
                let descriptor = wgpu::BufferDescriptor {
                    label: Some("staging of reads"),
                    size,
                    usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
                    mapped_at_creation: false,
                };
                self.checked(
                    |fault| fault.of("the staging buffer of reads".to_owned(), size),
                    || self.shared.device.create_buffer(&descriptor),
                )?
            }
        };
        Ok(staging.0.insert(buffer))
    }
}
