//! Readback of the positions of a few vertices.

use cutis_gpu::{BindGroup, Buffer, Gpu, GpuError, Kernel};
use cutis_shaders::solver;

use crate::body::DeviceBody;

/// Kernel and buffers of the last request. They are kept, because a caller that reads positions
/// every frame usually reads the same vertices.
pub(crate) struct Gather {
    kernel: Kernel,
    wanted: Vec<u32>,
    chunks: Vec<(BindGroup, Buffer<[f32; 4]>)>,
}

impl Gather {
    fn new(gpu: &Gpu, body: &DeviceBody, wanted: &[u32]) -> Result<Self, GpuError> {
        let kernel = gpu.kernel("gather", &solver::gather(), solver::GATHER)?;
        let mut chunks = Vec::new();
        for part in wanted.chunks(gpu.chunk_len(size_of::<[f32; 4]>())) {
            let indices = gpu.buffer("vertices to collect", part)?;
            let collected = gpu.zeroed("collected positions", part.len())?;
            let bindings = [(0, body.vertices.whole()), (1, indices.whole()), (2, collected.whole())];
            chunks.push((gpu.bind(&kernel, 0, &bindings)?, collected));
        }
        Ok(Self { kernel, wanted: wanted.to_vec(), chunks })
    }

    /// Reads the vertices `wanted`, all of which must exist. `last` keeps the buffers for the next
    /// call.
    pub(crate) fn read(
        last: &mut Option<Self>,
        gpu: &Gpu,
        body: &DeviceBody,
        wanted: &[u32],
    ) -> Result<Vec<[f32; 4]>, GpuError> {
        let gather = match last.take() {
            Some(gather) if gather.wanted == wanted => gather,
            _ => Self::new(gpu, body, wanted)?,
        };
        let gather = last.insert(gather);
        let mut pass = gpu.pass("gather");
        for (group, collected) in &gather.chunks {
            pass.dispatch(&gather.kernel, &[group], collected.len());
        }
        pass.submit()?;
        let mut found = Vec::with_capacity(wanted.len());
        for (_, collected) in &gather.chunks {
            found.extend(gpu.read(collected, 0..collected.len())?);
        }
        Ok(found)
    }
}
