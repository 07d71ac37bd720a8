//! Kinematic vertices on the device: where they began, and how far each handle has come in each substep of a frame.

use cutis_gpu::{BindGroup, Buffer, Gpu, GpuError, Kernel, Pass};
use cutis_shaders::solver;
use cutis_solver::{Carried, Clock, Settings, System};

use crate::body::{ALIGNMENT, Body};

/// The handles of a body.
pub(crate) struct Handles {
    kernel: Kernel,
    shared: BindGroup,
    chunks: Vec<(BindGroup, usize)>,
    /// One per substep of a frame.
    substeps: Vec<BindGroup>,
    paths: Buffer<[f32; 4]>,
    /// Distance between the paths of two substeps.
    stride: usize,
}

impl Handles {
    /// `None` for a body without handles, which needs no kernel for them.
    pub(crate) fn new(
        gpu: &Gpu,
        body: &Body,
        system: &System<f32>,
        settings: &Settings,
    ) -> Result<Option<Self>, GpuError> {
        let handles = system.handles();
        if handles.iter().all(|handle| handle.vertices().is_empty()) {
            return Ok(None);
        }
        let kernel = gpu.kernel("handles", &solver::carry(), solver::CARRY)?;
        let shared = gpu.bind(&kernel, 0, &[(0, body.vertices.whole())])?;
        let mut carried: Vec<[u32; 4]> = Vec::new();
        let mut owners: Vec<u32> = Vec::new();
        for (owner, handle) in (0..).zip(handles) {
            for (&vertex, rest) in handle.vertices().iter().zip(handle.rest()) {
                carried.push([rest.x.to_bits(), rest.y.to_bits(), rest.z.to_bits(), vertex]);
                owners.push(owner);
            }
        }
        let most = gpu.chunk_len(size_of::<[u32; 4]>());
        let mut chunks = Vec::new();
        for (carried, owners) in carried.chunks(most).zip(owners.chunks(most)) {
            let places = gpu.buffer("handles: vertices", carried)?;
            let owners = gpu.buffer("handles: owners", owners)?;
            let group = gpu.bind(&kernel, 1, &[(0, places.whole()), (1, owners.whole())])?;
            chunks.push((group, carried.len()));
        }
        let stride = handles.len().next_multiple_of(ALIGNMENT);
        let count = settings.substeps as usize;
        let paths = gpu.zeroed::<[f32; 4]>("handles: paths", stride.saturating_mul(count))?;
        let substeps = (0..count)
            .map(|substep| {
                gpu.bind(&kernel, 2, &[(0, paths.range(substep * stride..(substep + 1) * stride))])
            })
            .collect::<Result<_, _>>()?;
        Ok(Some(Self { kernel, shared, chunks, substeps, paths, stride }))
    }

    /// Writes where the handles are at the end of each substep from `clock` to the end of its frame.
    pub(crate) fn write_paths(
        &self,
        gpu: &Gpu,
        handles: &[Carried<f32>],
        mut clock: Clock,
        settings: &Settings,
    ) -> Result<(), GpuError> {
        let mut paths = vec![[0.0; 4]; self.paths.len()];
        let frame = clock.frame;
        while clock.frame == frame {
            let end = clock.time_s(settings) + settings.substep_s();
            let row = &mut paths[clock.substep as usize * self.stride..];
            for (place, handle) in row.iter_mut().zip(handles) {
                let path = handle.path(end);
                *place = [path.x, path.y, path.z, 0.0];
            }
            clock.tick(settings);
        }
        gpu.write(&self.paths, 0, &paths)
    }

    /// Puts the vertices where they are at the end of a substep.
    pub(crate) fn carry(&self, pass: &mut Pass<'_>, substep: u32) {
        let path = &self.substeps[substep as usize];
        for (chunk, threads) in &self.chunks {
            pass.dispatch(&self.kernel, &[&self.shared, chunk, path], *threads);
        }
    }
}
