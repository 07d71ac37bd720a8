//! What a device offers, and what is asked of it.

use std::fmt;

use crate::WORKGROUP;

/// The limits that matter to compute kernels. WebGPU's baseline, which every adapter that can be opened offers, is
/// 256 MiB, 128 MiB, 65 535, 2048 and 8.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Largest buffer, in bytes.
    pub max_buffer_bytes: u64,
    /// Largest range of a storage buffer that a kernel can see, in bytes.
    pub max_binding_bytes: u64,
    /// Most workgroups that one dispatch can start.
    pub max_workgroups: u32,
    /// Largest side of a 3-D texture, in texels.
    pub max_texture_3d: u32,
    /// Most storage buffers that one kernel can use.
    pub storage_buffers_per_stage: u32,
}

impl Limits {
    /// The part of wgpu's limits that this crate shows.
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

/// The limits to ask of an adapter that offers `offered`: the baseline exactly, or the baseline raised where compute
/// kernels gain from it. Alignments stay those of the baseline, so that offsets mean the same on every device, and a
/// thread index always fits in 32 bits.
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
    let most_workgroups = u32::MAX / WORKGROUP as u32;
    Ok(wgpu::Limits {
        max_buffer_size: offered.max_buffer_size,
        max_storage_buffer_binding_size: offered.max_storage_buffer_binding_size,
        max_uniform_buffer_binding_size: offered.max_uniform_buffer_binding_size,
        max_storage_buffers_per_shader_stage: offered.max_storage_buffers_per_shader_stage,
        max_compute_workgroups_per_dimension: offered
            .max_compute_workgroups_per_dimension
            .min(most_workgroups),
        max_texture_dimension_3d: offered.max_texture_dimension_3d,
        ..baseline
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_than_the_baseline_is_asked_for_unless_it_is_not_wanted() {
        let offered = wgpu::Limits {
            max_buffer_size: 1 << 40,
            max_compute_workgroups_per_dimension: u32::MAX,
            max_bind_groups: 8,
            min_storage_buffer_offset_alignment: 4,
            ..wgpu::Limits::default()
        };
        assert_eq!(requested(&offered, true), Ok(wgpu::Limits::default()));
        let asked = requested(&offered, false).unwrap();
        assert_eq!(asked.max_buffer_size, 1 << 40);
        assert_eq!(asked.max_bind_groups, 4, "no use for more");
        assert_eq!(asked.min_storage_buffer_offset_alignment, 256, "the same on every device");
        let threads = u64::from(asked.max_compute_workgroups_per_dimension) * WORKGROUP as u64;
        assert!(threads <= u64::from(u32::MAX), "a thread index fits in 32 bits");
    }

    #[test]
    fn an_adapter_below_the_baseline_is_refused_by_the_limit_it_misses() {
        let offered = wgpu::Limits { max_storage_buffers_per_shader_stage: 4, ..wgpu::Limits::default() };
        let expected = Shortfall { name: "max_storage_buffers_per_shader_stage", needed: 8, available: 4 };
        assert_eq!(requested(&offered, false), Err(expected));
        assert_eq!(requested(&offered, true), Err(expected));
        let words = "WebGPU's baseline limit max_storage_buffers_per_shader_stage: 8 needed, 4 offered";
        assert_eq!(expected.to_string(), words);
    }
}
