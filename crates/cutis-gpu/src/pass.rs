//! A compute pass: an ordered list of dispatches and copies that is submitted once.

use std::{fmt, ops::Range};

use crate::{BindGroup, Buffer, Gpu, GpuError, Kernel, WORKGROUP, counters::add};

/// Work for the device, recorded in order and submitted once. Each dispatch sees the results of the
/// ones before it. A pass that is dropped without [`Pass::submit`] does nothing.
#[must_use = "a pass does nothing until it is submitted"]
pub struct Pass<'gpu> {
    gpu: &'gpu Gpu,
    label: String,
    // Declared before the encoder, because it must be dropped first.
    open: Option<wgpu::ComputePass<'static>>,
    encoder: Option<wgpu::CommandEncoder>,
    dispatches: u64,
    error: Option<GpuError>,
}

impl Gpu {
    /// Starts a pass. Nothing is sent to the device before [`Pass::submit`].
    pub fn pass(&self, label: &str) -> Pass<'_> {
        Pass { gpu: self, label: label.to_owned(), open: None, encoder: None, dispatches: 0, error: None }
    }
}

impl Pass<'_> {
    /// Runs a kernel with `threads` threads, rounded up to whole workgroups. A kernel must
    /// therefore ignore threads beyond its items. For 0 threads nothing runs. `groups` may be in
    /// any order.
    ///
    /// [`Pass::submit`] returns an error for more threads than [`Gpu::chunk_len`] allows and for
    /// bind groups of another kernel.
    pub fn dispatch(&mut self, kernel: &Kernel, groups: &[&BindGroup], threads: usize) {
        if threads == 0 || self.error.is_some() {
            return;
        }
        let most = self.gpu.limits().max_workgroups;
        let workgroups = threads.div_ceil(WORKGROUP);
        let Some(workgroups) = u32::try_from(workgroups).ok().filter(|count| *count <= most) else {
            let what = format!("pass '{}': workgroups of kernel '{}'", self.label, kernel.label);
            self.error = Some(self.gpu.over_limit(what, workgroups as u64, u64::from(most)));
            return;
        };
        let pass = self.compute();
        pass.set_pipeline(&kernel.pipeline);
        for group in groups {
            pass.set_bind_group(group.group, &group.raw, &[]);
        }
        pass.dispatch_workgroups(workgroups, 1, 1);
        self.dispatches += 1;
    }

    /// Copies elements of one buffer to another, from element `to_offset` on.
    ///
    /// [`Pass::submit`] returns an error for a range that exceeds its buffer, for elements of less
    /// than 4 bytes that do not start and end at a multiple of 4 bytes, and for a copy within one
    /// buffer.
    pub fn copy<T>(&mut self, from: &Buffer<T>, from_range: Range<usize>, to: &Buffer<T>, to_offset: usize) {
        if self.error.is_some() {
            return;
        }
        let what = || format!("pass '{}': copying buffer '{}' to '{}'", self.label, from.label, to.label);
        let ranges = from.bytes_of(what, from_range.clone()).and_then(|source| {
            let target = to.bytes_of(what, to_offset..to_offset.saturating_add(from_range.len()))?;
            Ok((from.words_of(what, &source)?, to.words_of(what, &target)?))
        });
        match ranges {
            Err(error) => self.error = Some(error),
            Ok((source, _)) if source.is_empty() => {}
            Ok((source, target)) => {
                self.open = None;
                let size = source.end - source.start;
                self.encoder().copy_buffer_to_buffer(&from.raw, source.start, &to.raw, target.start, size);
            }
        }
    }

    /// Submits the work to the device without waiting for it. An empty pass is not submitted.
    ///
    /// # Errors
    ///
    /// Returns the first error that occurred while the pass was recorded, [`GpuError::Validation`]
    /// if the device rejects the work, [`GpuError::OutOfMemory`] or [`GpuError::Lost`]. In these
    /// cases nothing runs.
    pub fn submit(mut self) -> Result<(), GpuError> {
        self.gpu.alive()?;
        if let Some(error) = self.error {
            return Err(error);
        }
        self.open = None;
        let Some(mut encoder) = self.encoder else { return Ok(()) };
        let shared = &self.gpu.shared;
        let explain = |fault: crate::device::Fault| fault.of(format!("pass '{}'", self.label), 0);
        if let Some(timing) = &shared.timing {
            timing.resolve(&mut encoder, self.dispatches > 0);
        }
        let commands = self.gpu.checked(explain, || encoder.finish())?;
        self.gpu.checked(explain, || shared.queue.submit([commands]))?;
        add(&shared.tally.submits, 1);
        add(&shared.tally.dispatches, self.dispatches);
        Ok(())
    }

    /// Returns the open compute pass, or opens one.
    fn compute(&mut self) -> &mut wgpu::ComputePass<'static> {
        let pass = match self.open.take() {
            Some(pass) => pass,
            None => {
                let first = self.dispatches == 0;
                let label = self.label.clone();
                let gpu = self.gpu;
                let timestamp_writes = gpu.shared.timing.as_ref().map(|timing| timing.writes(first));
                let descriptor = wgpu::ComputePassDescriptor { label: Some(&label), timestamp_writes };
                self.encoder().begin_compute_pass(&descriptor).forget_lifetime()
            }
        };
        self.open.insert(pass)
    }

    fn encoder(&mut self) -> &mut wgpu::CommandEncoder {
        let descriptor = wgpu::CommandEncoderDescriptor { label: Some(&self.label) };
        self.encoder.get_or_insert_with(|| self.gpu.shared.device.create_command_encoder(&descriptor))
    }
}

impl fmt::Debug for Pass<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Pass")
            .field("label", &self.label)
            .field("dispatches", &self.dispatches)
            .finish_non_exhaustive()
    }
}
