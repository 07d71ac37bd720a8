//! The ray marching kernels, compiled when a view first needs them, and the depth volume.

use cutis_gpu::{Gpu, GpuError, Kernel, Texture3d};
use cutis_shaders::render::{Albedo, RAYMARCH, raymarch};
use cutis_volume::Volume;

/// Kernels and depth volume of the views so far.
#[derive(Default)]
pub struct Kernels<'a> {
    skin: Option<Kernel>,
    wound: Option<Kernel>,
    depth: Option<(&'a Volume, Texture3d)>,
}

impl<'a> Kernels<'a> {
    /// The kernel for views with or without a depth volume, and that volume on the device.
    pub fn of(
        &mut self,
        gpu: &Gpu,
        depth: Option<&'a Volume>,
    ) -> Result<(&Kernel, Option<&Texture3d>), GpuError> {
        let Some(depth) = depth else { return Ok((compiled(&mut self.skin, gpu, Albedo::Skin)?, None)) };
        // The volume is borrowed as long as `self` exists, so that the same address is the same
        // volume.
        let texture = match self.depth.take() {
            Some((known, texture)) if std::ptr::eq(known, depth) => texture,
            other => {
                drop(other);
                gpu.texture_3d("depth", depth.grid().shape, depth.voxels())?
            }
        };
        let (_, texture) = self.depth.insert((depth, texture));
        Ok((compiled(&mut self.wound, gpu, Albedo::Wound)?, Some(texture)))
    }
}

fn compiled<'k>(slot: &'k mut Option<Kernel>, gpu: &Gpu, albedo: Albedo) -> Result<&'k Kernel, GpuError> {
    let kernel = match slot.take() {
        Some(kernel) => kernel,
        None => gpu.kernel("ray march", &raymarch(albedo), RAYMARCH)?,
    };
    Ok(slot.insert(kernel))
}
