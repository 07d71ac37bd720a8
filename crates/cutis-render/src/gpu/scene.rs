//! A volume on the device, and rays through it.

use bytemuck::Zeroable;
use cutis_gpu::{Binding, Buffer, Gpu, GpuError, Kernel, Texture3d};
use cutis_shaders::render::{LARGEST_PER_BLOCK, largest_per_block};
use cutis_volume::Volume;

use super::uniform::{ViewUniform, single};
use crate::expose::BATCH;
use crate::rays::Rays;

/// Cells per block along each axis, as in the shader.
const SIDE: usize = 8;

/// Number of blocks along each axis of a grid of voxels.
pub fn block_shape(voxels: [usize; 3]) -> [usize; 3] {
    voxels.map(|n| n.saturating_sub(1).div_ceil(SIDE).max(1))
}

/// Buffers that are reused from view to view.
pub struct Scene {
    voxels: Texture3d,
    scale: Buffer<[f32; 2]>,
    /// Largest HU per block.
    pub largest: Buffer<f32>,
    view: Buffer<ViewUniform>,
    /// Rays of one submission and their results.
    rays: Buffer<[f32; 4]>,
    found: Buffer<[f32; 4]>,
}

impl Scene {
    pub fn new(gpu: &Gpu, volume: &Volume) -> Result<Self, GpuError> {
        let shape = volume.grid().shape;
        let together = BATCH.min(gpu.chunk_len(size_of::<[f32; 4]>()));
        let scene = Self {
            voxels: gpu.texture_3d("volume", shape, volume.voxels())?,
            scale: gpu.uniform("scale of the volume", &[volume.slope(), volume.intercept()])?,
            largest: gpu.zeroed("largest HU per block", block_shape(shape).iter().product())?,
            view: gpu.uniform("view", &ViewUniform::zeroed())?,
            rays: gpu.zeroed("rays", together)?,
            found: gpu.zeroed("found by the rays", together)?,
        };
        let kernel = gpu.kernel("largest per block", &largest_per_block(), LARGEST_PER_BLOCK)?;
        let bindings = [(0, scene.voxels.whole()), (1, scene.scale.whole()), (2, scene.largest.whole())];
        let group = gpu.bind(&kernel, 0, &bindings)?;
        let mut pass = gpu.pass("largest per block");
        // A thread processes several blocks if there are more blocks than threads.
        pass.dispatch(&kernel, &[&group], scene.largest.len().min(gpu.chunk_len(size_of::<f32>())));
        pass.submit()?;
        Ok(scene)
    }

    /// Sets the view for the next calls of [`Scene::trace`].
    pub fn look(&self, gpu: &Gpu, view: &ViewUniform) -> Result<(), GpuError> {
        gpu.write(&self.view, 0, std::slice::from_ref(view))
    }

    /// Linear light of each ray, and the number of steps to the surface; −1 if there is none.
    pub fn trace(
        &self,
        gpu: &Gpu,
        kernel: &Kernel,
        depth: Option<&Texture3d>,
        starts: &[[f32; 4]],
    ) -> Result<Vec<[f32; 4]>, GpuError> {
        let mut found = Vec::with_capacity(starts.len());
        for chunk in starts.chunks(self.rays.len()) {
            gpu.write(&self.rays, 0, chunk)?;
            let mut bindings: Vec<(u32, Binding<'_>)> = vec![
                (0, self.voxels.whole()),
                (1, self.scale.whole()),
                (2, self.view.whole()),
                (3, self.largest.whole()),
                (4, self.rays.range(0..chunk.len())),
                (5, self.found.range(0..chunk.len())),
            ];
            bindings.extend(depth.map(|depth| (6, depth.whole())));
            let group = gpu.bind(kernel, 0, &bindings)?;
            let mut pass = gpu.pass("ray march");
            pass.dispatch(kernel, &[&group], chunk.len());
            pass.submit()?;
            found.extend(gpu.read(&self.found, 0..chunk.len())?);
        }
        Ok(found)
    }
}

/// Beginning of a ray as a continuous index, and its length in steps; −1 if it misses the volume.
pub fn start(rays: &Rays<'_>, place: [f64; 2]) -> [f32; 4] {
    rays.through(place).map_or([0.0, 0.0, 0.0, -1.0], |ray| {
        let [x, y, z] = rays.at(&ray, 0.0).coords.map(single).into();
        [x, y, z, single(ray.length)]
    })
}
