//! Reading memory of the device, through one staging buffer that stays.

use std::{ops::Range, sync::mpsc};

use bytemuck::Pod;

use crate::{Buffer, Gpu, GpuError, buffer::WORD, counters::add, device::lock};

/// The staging buffer grows up to this many bytes; larger reads go in parts.
const LARGEST: u64 = 32 << 20;

/// It starts with this many.
const SMALLEST: u64 = 64 << 10;

/// The staging buffer, once something was read.
#[derive(Default)]
pub(crate) struct Staging(Option<wgpu::Buffer>);

impl Gpu {
    /// Reads these elements, after all that was submitted before. Waits for the device: a frame should not need it.
    ///
    /// # Errors
    ///
    /// [`GpuError::Range`] when the range does not lie within the buffer, [`GpuError::Readback`] when the memory cannot
    /// be mapped, [`GpuError::Validation`] for a uniform buffer (those cannot be read), [`GpuError::Lost`].
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

    /// Copies the bytes from `start` on into `into`, part by part.
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
            let last = end.next_multiple_of(WORD).min(first + LARGEST);
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

    /// Copies whole words `words` of `from`, of which the first `skip` bytes are not wanted, into `into`.
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
        let (tell, answer) = mpsc::channel();
        let sent = self.checked(
            |fault| fault.of(format!("reading buffer '{label}'"), size),
            || {
                let mut encoder = self.shared.device.create_command_encoder(&Default::default());
                encoder.copy_buffer_to_buffer(from, words.start, target, 0, size);
                let sent = self.shared.queue.submit([encoder.finish()]);
                target.map_async(wgpu::MapMode::Read, 0..size, move |mapped| {
                    let _ = tell.send(mapped);
                });
                sent
            },
        )?;
        self.poll(wgpu::PollType::Wait { submission_index: Some(sent), timeout: None })?;
        // The thread that brings the answer may be another one that polled at the same time, a moment later.
        match answer.recv() {
            Ok(Ok(())) => {}
            Ok(Err(error)) => return Err(failed(error.to_string())),
            Err(_) => return Err(failed("the device did not answer".to_owned())),
        }
        let view = target.get_mapped_range(0..size).map_err(|error| failed(error.to_string()))?;
        into.copy_from_slice(&view[skip..skip + into.len()]);
        drop(view);
        self.checked(|fault| fault.of(format!("reading buffer '{label}'"), size), || target.unmap())
    }

    /// A staging buffer of at least `size` bytes.
    fn staging<'a>(&self, staging: &'a mut Staging, size: u64) -> Result<&'a wgpu::Buffer, GpuError> {
        let fitting = staging.0.take().filter(|buffer| buffer.size() >= size);
        let buffer = match fitting {
            Some(buffer) => buffer,
            None => {
                let size = size.next_power_of_two().clamp(SMALLEST, LARGEST);
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
