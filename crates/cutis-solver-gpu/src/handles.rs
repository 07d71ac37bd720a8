//! Kinematic vertices on the device: where they were grabbed, and the displacement of each handle
//! in each substep of a frame.

use cutis_gpu::{BindGroup, Buffer, Gpu, GpuError, Kernel, Pass};
use cutis_shaders::solver;
use cutis_solver::{Clock, KinematicHandle, Settings, System};

use crate::body::DeviceBody;

/// Kernel and buffers of the handles of a body.
pub(crate) struct Handles {
    kernel: Kernel,
    shared: BindGroup,
    chunks: Vec<(BindGroup, usize)>,
    /// The struct `Frame` of the shader.
    frame: Buffer<[u32; 2]>,
    paths: Buffer<[f32; 4]>,
}

impl Handles {
    /// Returns `None` for a body without handles, which needs no kernel for them.
    pub(crate) fn new(
        gpu: &Gpu,
        body: &DeviceBody,
        system: &System<f32>,
        settings: &Settings,
    ) -> Result<Option<Self>, GpuError> {
        let handles = system.handles();
        if handles.iter().all(|handle| handle.vertices().is_empty()) {
            return Ok(None);
        }
        let kernel = gpu.kernel("handles", &solver::kinematic(), solver::KINEMATIC)?;
        let frame = gpu.uniform("handles: frame", &[0; 2])?;
        let paths = handles.len().saturating_mul(settings.substeps as usize);
        let paths = gpu.zeroed::<[f32; 4]>("handles: paths", paths)?;
        let bindings = [body.vertices.whole(), body.status.whole(), frame.whole(), paths.whole()];
        let bindings: Vec<_> = (0..).zip(bindings).collect();
        let shared = gpu.bind(&kernel, 0, &bindings)?;
        let mut held: Vec<[u32; 4]> = Vec::new();
        let mut owners: Vec<u32> = Vec::new();
        for (owner, handle) in (0..).zip(handles) {
            for (&vertex, start) in handle.vertices().iter().zip(handle.start()) {
                held.push([start.x.to_bits(), start.y.to_bits(), start.z.to_bits(), vertex]);
                owners.push(owner);
            }
        }
        let most = gpu.chunk_len(size_of::<[u32; 4]>());
        let mut chunks = Vec::new();
        for (held, owners) in held.chunks(most).zip(owners.chunks(most)) {
            let vertices = gpu.buffer("handles: vertices", held)?;
            let owners = gpu.buffer("handles: owners", owners)?;
            let group = gpu.bind(&kernel, 1, &[(0, vertices.whole()), (1, owners.whole())])?;
            chunks.push((group, held.len()));
        }
        Ok(Some(Self { kernel, shared, chunks, frame, paths }))
    }

    /// Uploads the displacement of each handle at the end of each substep, from `clock` to the end
    /// of its frame. `done` is the number of substeps since the status was cleared.
    pub(crate) fn write_paths(
        &self,
        gpu: &Gpu,
        handles: &[KinematicHandle<f32>],
        mut clock: Clock,
        settings: &Settings,
        done: u32,
    ) -> Result<(), GpuError> {
        let mut paths = Vec::with_capacity(self.paths.len());
        let frame = clock.frame;
        while clock.frame == frame {
            let end = clock.time_s(settings) + settings.substep_s();
            for handle in handles {
                let path = handle.path(end);
                paths.push([path.x, path.y, path.z, 0.0]);
            }
            clock.tick(settings);
        }
        gpu.write(&self.frame, 0, &[[done, handles.len() as u32]])?;
        gpu.write(&self.paths, 0, &paths)
    }

    /// Moves the vertices to their positions at the end of the current substep.
    pub(crate) fn advance(&self, pass: &mut Pass<'_>) {
        for (chunk, threads) in &self.chunks {
            pass.dispatch(&self.kernel, &[&self.shared, chunk], *threads);
        }
    }
}
