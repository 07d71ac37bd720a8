//! Limits of devices.

use std::fmt;

use crate::WORKGROUP;

/// The limits that matter for compute kernels. WebGPU's baseline is 256 MiB, 128 MiB, 65 535, 2048
/// and 8. Every adapter that can be opened reaches it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Largest buffer, in bytes.
    pub max_buffer_bytes: u64,
    /// Largest range of a storage buffer that can be bound to a kernel, in bytes.
    pub max_binding_bytes: u64,
    /// Largest number of workgroups of one dispatch.
    pub max_workgroups: u32,
    /// Largest side of a 3-D texture, in texels.
    pub max_texture_3d: u32,
    /// Largest number of storage buffers of one kernel.
    pub storage_buffers_per_stage: u32,
}

impl Limits {
    /// Selects the limits that this crate exposes.
    pub(crate) fn of(limits: &wgpu::Limits) -> Limits {
        Limits {
            max_buffer_bytes: limits.max_buffer_size,
            max_binding_bytes: limits.max_storage_buffer_binding_size,
            max_workgroups: limits.max_compute_workgroups_per_dimension,
            max_texture_3d: limits.max_texture_dimension_3d,
            storage_buffers_per_stage: limits.max_storage_buffers_per_shader_stage,
        }
    }
}

/// A limit of WebGPU's baseline that an adapter does not reach.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shortfall {
    /// wgpu's name of the limit.
    pub(crate) name: &'static str,
    /// The baseline's value.
    pub(crate) needed: u64,
    /// The adapter's value.
    pub(crate) available: u64,
}

impl fmt::Display for Shortfall {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Shortfall { name, needed, available } = self;
        write!(f, "WebGPU's baseline limit {name}: {needed} needed, {available} offered")
    }
}

/// Returns the limits to request from an adapter that offers `offered`. They are exactly the
/// baseline, or the baseline with higher values that help compute kernels. Alignments stay those of
/// the baseline, so that offsets are valid on every device. A thread index always fits in 32 bits.
pub(crate) fn requested(offered: &wgpu::Limits, baseline_only: bool) -> Result<wgpu::Limits, Shortfall> {
    let baseline = wgpu::Limits::default();
    let mut missing = None;
    baseline.check_limits_with_fail_fn(offered, true, |name, needed, available| {
        missing = Some(Shortfall { name, needed, available });
    });
    if let Some(shortfall) = missing {
        return Err(shortfall);
    }
    if baseline_only {
        return Ok(baseline);
    }
    let max_workgroups = u32::MAX / WORKGROUP as u32;
    Ok(wgpu::Limits {
        max_buffer_size: offered.max_buffer_size,
        max_storage_buffer_binding_size: offered.max_storage_buffer_binding_size,
        max_uniform_buffer_binding_size: offered.max_uniform_buffer_binding_size,
        max_storage_buffers_per_shader_stage: offered.max_storage_buffers_per_shader_stage,
        max_compute_workgroups_per_dimension: offered
            .max_compute_workgroups_per_dimension
            .min(max_workgroups),
        max_texture_dimension_3d: offered.max_texture_dimension_3d,
        ..baseline
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn higher_limits_are_requested_except_with_baseline_only() {
        let offered = wgpu::Limits {
            max_buffer_size: 1 << 40,
            max_compute_workgroups_per_dimension: u32::MAX,
            max_bind_groups: 8,
            min_storage_buffer_offset_alignment: 4,
            ..wgpu::Limits::default()
        };
        assert_eq!(requested(&offered, true), Ok(wgpu::Limits::default()));
        let limits = requested(&offered, false).unwrap();
        assert_eq!(limits.max_buffer_size, 1 << 40);
        assert_eq!(limits.max_bind_groups, 4, "kernels do not need more");
        assert_eq!(limits.min_storage_buffer_offset_alignment, 256, "the same on every device");
        let threads = u64::from(limits.max_compute_workgroups_per_dimension) * WORKGROUP as u64;
        assert!(threads <= u64::from(u32::MAX), "a thread index fits in 32 bits");
    }

    #[test]
    fn an_error_names_the_limit_that_an_adapter_does_not_reach() {
        let offered = wgpu::Limits { max_storage_buffers_per_shader_stage: 4, ..wgpu::Limits::default() };
        let expected = Shortfall { name: "max_storage_buffers_per_shader_stage", needed: 8, available: 4 };
        assert_eq!(requested(&offered, false), Err(expected));
        assert_eq!(requested(&offered, true), Err(expected));
        let message = "WebGPU's baseline limit max_storage_buffers_per_shader_stage: 8 needed, 4 offered";
        assert_eq!(expected.to_string(), message);
    }
}
