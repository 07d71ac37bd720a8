//! Device time of the last pass, by timestamps.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::{Gpu, GpuError};

/// Number of timestamps: the start of a pass and its end.
const STAMPS: u32 = 2;
const BYTES: u64 = STAMPS as u64 * size_of::<u64>() as u64;

/// Timestamps of the last submitted pass on the device.
pub(crate) struct Timing {
    stamps: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    nanoseconds_per_tick: f32,
    any: AtomicBool,
}

impl Timing {
    pub(crate) fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Timing {
        Timing {
            stamps: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("timestamps"),
                ty: wgpu::QueryType::Timestamp,
                count: STAMPS,
            }),
            resolved: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("timestamps"),
                size: BYTES,
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
            nanoseconds_per_tick: queue.get_timestamp_period(),
            any: AtomicBool::new(false),
        }
    }

    /// Returns the timestamps that a compute pass writes. Copies split a pass into several compute
    /// passes. The first one writes the start, and each one overwrites the end.
    pub(crate) fn writes(&self, first: bool) -> wgpu::ComputePassTimestampWrites<'_> {
        wgpu::ComputePassTimestampWrites {
            query_set: &self.stamps,
            beginning_of_pass_write_index: first.then_some(0),
            end_of_pass_write_index: Some(1),
        }
    }

    /// Stores the timestamps if the pass has any.
    pub(crate) fn resolve(&self, encoder: &mut wgpu::CommandEncoder, any: bool) {
        if any {
            encoder.resolve_query_set(&self.stamps, 0..STAMPS, &self.resolved, 0);
        }
        self.any.store(any, Ordering::Relaxed);
    }
}

impl Gpu {
    /// Returns the device time of the last submitted pass in nanoseconds, from the start of its
    /// first dispatch to the end of its last. `None` if
    /// [`GpuOptions::timestamps`](crate::GpuOptions) is off, the adapter does not support
    /// timestamps, or the pass had no dispatch. Waits for the device and does not count as a
    /// readback.
    ///
    /// # Errors
    ///
    /// Returns [`GpuError::Readback`] or [`GpuError::Lost`].
    pub fn last_pass_ns(&self) -> Result<Option<u64>, GpuError> {
        self.alive()?;
        let Some(timing) = self.shared.timing.as_ref().filter(|timing| timing.any.load(Ordering::Relaxed))
        else {
            return Ok(None);
        };
        let mut stamps = [0_u64; STAMPS as usize];
        self.download(&timing.resolved, "timestamps", 0, bytemuck::cast_slice_mut(&mut stamps))?;
        let ticks = stamps[1].saturating_sub(stamps[0]);
        Ok(Some((ticks as f64 * f64::from(timing.nanoseconds_per_tick)).round() as u64))
    }
}
