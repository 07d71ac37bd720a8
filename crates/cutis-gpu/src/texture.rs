//! Volumes of 16-bit integers as 3-D textures.

use std::{fmt, sync::Arc};

use crate::{
    Binding, Gpu, GpuError,
    buffer::PART,
    counters::{Memory, add},
};

/// A volume of signed 16-bit integers on the device, with x as the fastest axis. In a kernel it is
/// a `texture_3d<i32>`, and `textureLoad(volume, vec3<i32>(x, y, z), 0)` reads a voxel.
pub struct Texture3d {
    view: wgpu::TextureView,
    label: String,
    shape: [usize; 3],
    memory: Arc<Memory>,
}

impl Gpu {
    /// Creates a volume of `shape` = `[nx, ny, nz]` voxels with the given values, x fastest.
    ///
    /// # Errors
    ///
    /// Returns [`GpuError::Limit`] if a side exceeds the device's limit, [`GpuError::Validation`]
    /// if a side is 0 or the number of values is not that of the shape, [`GpuError::OutOfMemory`],
    /// and [`GpuError::Lost`].
    pub fn texture_3d(&self, label: &str, shape: [usize; 3], voxels: &[i16]) -> Result<Texture3d, GpuError> {
        let what = || format!("volume '{label}' of {} x {} x {} voxels", shape[0], shape[1], shape[2]);
        self.alive()?;
        let most = self.limits().max_texture_3d;
        if let Some(&side) = shape.iter().find(|side| **side > most as usize) {
            return Err(self.over_limit(format!("longest side of {}", what()), side as u64, u64::from(most)));
        }
        let voxel_count = shape.iter().try_fold(1_usize, |count, &side| count.checked_mul(side));
        if voxel_count != Some(voxels.len()) || voxels.is_empty() {
            let message = format!("{} values; expected one per voxel, and at least one voxel", voxels.len());
            return Err(GpuError::Validation { what: what(), message });
        }
        let [nx, ny, nz] = shape.map(|side| side as u32); // within max_texture_3d
        let bytes = size_of_val(voxels) as u64;
        let descriptor = wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d { width: nx, height: ny, depth_or_array_layers: nz },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D3,
            format: wgpu::TextureFormat::R16Sint,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        };
        let raw =
            self.checked(|fault| fault.of(what(), bytes), || self.shared.device.create_texture(&descriptor))?;

        let slice = shape[0] * shape[1];
        let layers = (PART / (2 * slice)).max(1);
        for (index, part) in voxels.chunks(layers * slice).enumerate() {
            let at = wgpu::TexelCopyTextureInfo {
                texture: &raw,
                mip_level: 0,
                origin: wgpu::Origin3d { x: 0, y: 0, z: (index * layers) as u32 },
                aspect: wgpu::TextureAspect::All,
            };
            let layout = wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(2 * nx),
                rows_per_image: Some(ny),
            };
            let depth = (part.len() / slice) as u32;
            let size = wgpu::Extent3d { width: nx, height: ny, depth_or_array_layers: depth };
            self.checked(
                |fault| fault.of(what(), size_of_val(part) as u64),
                || self.shared.queue.write_texture(at, bytemuck::cast_slice(part), layout, size),
            )?;
            if part.len() < voxels.len() {
                self.flush(&what)?;
            }
        }
        let view = self.checked(|fault| fault.of(what(), 0), || raw.create_view(&Default::default()))?;
        add(&self.shared.tally.textures, 1);
        let memory = Memory::new(&self.shared.tally, bytes, |tally| &tally.texture_bytes);
        Ok(Texture3d { view, label: label.to_owned(), shape, memory })
    }
}

impl Texture3d {
    /// Returns a binding of the volume.
    pub fn whole(&self) -> Binding<'_> {
        Binding::texture(&self.view, &self.memory)
    }

    /// Returns the number of voxels along x, y and z.
    pub fn shape(&self) -> [usize; 3] {
        self.shape
    }
}

impl fmt::Debug for Texture3d {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Texture3d")
            .field("label", &self.label)
            .field("shape", &self.shape)
            .finish_non_exhaustive()
    }
}
