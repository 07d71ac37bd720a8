//! Timestamps of the last pass.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::{Gpu, GpuError};

/// Two timestamps: the begin of a pass and its end.
const STAMPS: u32 = 2;
const BYTES: u64 = STAMPS as u64 * size_of::<u64>() as u64;

/// Where the device leaves the timestamps of the last submitted pass.
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

    /// What a compute pass writes: a pass that copies interrupt is several, of which the first stamps the begin and
    /// each the end, so that the last one's end stays.
    pub(crate) fn writes(&self, first: bool) -> wgpu::ComputePassTimestampWrites<'_> {
        wgpu::ComputePassTimestampWrites {
            query_set: &self.stamps,
            beginning_of_pass_write_index: first.then_some(0),
            end_of_pass_write_index: Some(1),
        }
    }

    /// Keeps the timestamps, if the pass has any.
    pub(crate) fn resolve(&self, encoder: &mut wgpu::CommandEncoder, any: bool) {
        if any {
            encoder.resolve_query_set(&self.stamps, 0..STAMPS, &self.resolved, 0);
        }
        self.any.store(any, Ordering::Relaxed);
    }
}

impl Gpu {
    /// Nanoseconds that the device took from the begin of the first dispatch to the end of the last one of the last
    /// submitted pass. None when timestamps were not asked for, the adapter has none, or nothing was dispatched. Waits
    /// for the device; not counted as a readback.
    ///
    /// # Errors
    ///
    /// [`GpuError::Readback`], [`GpuError::Lost`].
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
