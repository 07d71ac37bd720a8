//! A resampler that keeps a volume and a mesh on the device.

use cutis_gpu::{BindGroup, Buffer, Gpu, GpuError, Pass};
use cutis_volume::Volume;
use nalgebra::Point3;

use super::bound::{BoundSlab, RemovedChunk, TetChunk};
use super::kernels::Kernels;
use super::memory::{COUNTS, Memory, NO_REACH, Plan};
use super::setup::{ResamplerOptions, Setup, relative};
use super::state::{SlabState, mark_words, report};
use crate::report::ResampleReport;
use crate::warp::check_finite;
use crate::{ResampleError, Warp};

/// Resamples one volume through many states of one mesh, on a GPU.
///
/// The volume, the tets and the rest positions are uploaded once. A state comes from the host
/// ([`ResamplerGpu::resample`]) or is already on the device ([`ResamplerGpu::resample_device`]).
/// The result stays on the device until [`ResamplerGpu::volume`] reads it.
pub struct ResamplerGpu {
    gpu: Gpu,
    kernels: Kernels,
    grid: cutis_volume::Grid,
    slope: f32,
    intercept: f32,
    offset: [f32; 3],
    memory: Memory,
    span_mesh: BindGroup,
    chunks: Vec<TetChunk>,
    removed: Vec<RemovedChunk>,
    slabs: Vec<BoundSlab>,
    /// Largest number of tets on a list of large tets.
    listed: usize,
    /// Buffer for positions from the host, created by the first upload.
    uploaded: Option<Buffer<[f32; 4]>>,
}

impl ResamplerGpu {
    /// Uploads the volume and the warp without its deformed positions.
    ///
    /// # Errors
    /// The errors of [`Setup::new`], and [`ResampleError::Gpu`] if the device refuses or has too
    /// little memory.
    pub fn new(
        gpu: &Gpu,
        volume: &Volume,
        warp: &Warp<'_>,
        options: &ResamplerOptions,
    ) -> Result<Self, ResampleError> {
        Self::with_sources(gpu, volume, warp, options, &|source| source)
    }

    /// As [`ResamplerGpu::new`], with each kernel source passed through `change`. Parity tests use
    /// it to show that they detect a wrong kernel.
    ///
    /// # Errors
    /// The errors of [`ResamplerGpu::new`].
    pub fn with_sources(
        gpu: &Gpu,
        volume: &Volume,
        warp: &Warp<'_>,
        options: &ResamplerOptions,
        change: &dyn Fn(String) -> String,
    ) -> Result<Self, ResampleError> {
        let setup = Setup::new(volume, warp, options)?;
        let plan = Plan::new(gpu, volume.grid().shape, warp, options);
        let kernels = Kernels::new(gpu, change)?;
        let memory = Memory::new(gpu, volume, &setup, &plan)?;
        let mut chunks = Vec::with_capacity(plan.chunks);
        for number in 0..plan.chunks {
            let first = number * plan.chunk_tets;
            let tets = &warp.tets[first..warp.tets.len().min(first + plan.chunk_tets)];
            let body = warp.body_tets.saturating_sub(first).min(tets.len());
            chunks.push(TetChunk::new(gpu, &kernels, &memory, tets, first, body, 2 * number)?);
        }
        let removed = warp
            .removed
            .chunks(plan.chunk_tets)
            .enumerate()
            .map(|(n, tets)| RemovedChunk::new(gpu, &kernels, &memory, tets, 2 * plan.chunks + n))
            .collect::<Result<Vec<_>, _>>()?;
        let [columns, rows, _] = volume.grid().shape;
        let bind_slab = |(number, slices)| {
            BoundSlab::new(gpu, &kernels, &memory, number, slices, columns * rows, plan.lists())
        };
        let slabs = plan.slabs.iter().enumerate().map(bind_slab).collect::<Result<Vec<_>, _>>()?;
        let Memory { grid, places, rest_places, counters, reaches, .. } = &memory;
        let mesh = [
            (0, grid.whole()),
            (1, places.whole()),
            (2, rest_places.whole()),
            (3, counters.whole()),
            (4, reaches.whole()),
        ];
        let resampler = Self {
            span_mesh: gpu.bind(&kernels.span, 0, &mesh)?,
            gpu: gpu.clone(),
            kernels,
            grid: *volume.grid(),
            slope: volume.slope(),
            intercept: volume.intercept(),
            offset: options.offset,
            memory,
            chunks,
            removed,
            slabs,
            listed: plan.listed,
            uploaded: None,
        };
        resampler.rest()?;
        Ok(resampler)
    }

    /// Resamples through deformed positions in local meters, one per vertex. Does not wait for the
    /// device.
    ///
    /// # Errors
    /// [`ResampleError::VertexCount`], [`ResampleError::NotFinite`], [`ResampleError::Gpu`].
    pub fn resample(&mut self, deformed: &[Point3<f32>]) -> Result<(), ResampleError> {
        self.check_count(deformed.len())?;
        check_finite("deformed", deformed)?;
        let positions = relative(deformed, self.offset);
        let buffer = match self.uploaded.take() {
            Some(buffer) => buffer,
            None => self.gpu.zeroed("resample: positions", positions.len())?,
        };
        self.gpu.write(&buffer, 0, &positions)?;
        let done = self.resample_device(&buffer);
        self.uploaded = Some(buffer);
        done
    }

    /// Resamples through positions that are on the device: x, y, z in local meters minus
    /// [`offset`](ResamplerOptions::offset). The fourth component is ignored, and so are positions
    /// beyond the number of vertices. Nothing is read back, and the host does not wait. A tet with
    /// a position that is not finite holds no voxel.
    ///
    /// # Errors
    /// [`ResampleError::VertexCount`] if there are fewer positions than vertices,
    /// [`ResampleError::Gpu`].
    pub fn resample_device(&mut self, positions: &Buffer<[f32; 4]>) -> Result<(), ResampleError> {
        if positions.len() < self.memory.rest.len() {
            return self.check_count(positions.len());
        }
        let Memory { counters, reaches, .. } = &self.memory;
        self.gpu.write(counters, 0, &vec![0; counters.len()])?;
        self.gpu.write(reaches, 0, &vec![NO_REACH; 2 * self.chunks.len()])?;
        for slab in 0..self.slabs.len() {
            let mut pass = self.gpu.pass("resample");
            if slab == 0 {
                self.place(&mut pass, positions)?;
            }
            self.fill(&mut pass, slab);
            pass.submit()?;
        }
        Ok(())
    }

    /// Reads the counts of the last resampling. Waits for the device.
    ///
    /// # Errors
    /// [`ResampleError::Gpu`].
    pub fn report(&self) -> Result<ResampleReport, ResampleError> {
        let counters = self.gpu.read(&self.memory.counters, 0..self.memory.counters.len())?;
        let inverted = ResampleReport { inverted_tets: counters[0] as usize, ..ResampleReport::default() };
        let (slabs, _) = counters[1..].as_chunks::<COUNTS>();
        Ok(slabs.iter().map(report).fold(inverted, |a, b| a + b))
    }

    /// Reads the resampled volume. Waits for the device. `progress(done, total)` is called for each
    /// slab that was read.
    ///
    /// # Errors
    /// [`ResampleError::Gpu`].
    pub fn volume(&self, progress: &(dyn Fn(usize, usize) + Sync)) -> Result<Volume, ResampleError> {
        let mut voxels = Vec::with_capacity(self.grid.len());
        for (number, slab) in self.slabs.iter().enumerate() {
            voxels.extend(self.values(slab)?);
            progress(number + 1, self.slabs.len());
        }
        Ok(Volume::new(self.grid, voxels, self.slope, self.intercept)?)
    }

    /// Memory on the device in bytes, without some hundred bytes for each slab and each chunk of
    /// tets.
    pub fn bytes(&self) -> u64 {
        let tets =
            self.chunks.iter().map(TetChunk::bytes).chain(self.removed.iter().map(RemovedChunk::bytes));
        let values = self.slabs.iter().map(|slab| slab.values.bytes());
        let uploaded = self.uploaded.as_ref().map_or(0, Buffer::bytes);
        self.memory.bytes() + tets.chain(values).sum::<u64>() + uploaded
    }

    /// Number of slabs that the volume is divided into.
    pub fn slabs(&self) -> usize {
        self.slabs.len()
    }

    /// Resamples one slab again and reads its whole state, for comparisons with a reference
    /// implementation.
    ///
    /// # Errors
    /// [`ResampleError::NoSuchSlab`], [`ResampleError::Gpu`].
    pub fn slab_state(&mut self, number: usize) -> Result<SlabState, ResampleError> {
        let slabs = self.slabs.len();
        let slab = self.slabs.get(number).ok_or(ResampleError::NoSuchSlab { slab: number, slabs })?;
        let Memory { counters, owners, marks, .. } = &self.memory;
        self.gpu.write(counters, slab.counts.start, &vec![0; slab.counts.len()])?;
        let mut pass = self.gpu.pass("resample: one slab");
        self.fill(&mut pass, number);
        pass.submit()?;
        let mut state = SlabState::clear(slab.voxels);
        state.owners = self.gpu.read(owners, 0..slab.voxels)?;
        state.marks = self.gpu.read(marks, 0..mark_words(slab.voxels))?;
        state.values = self.values(slab)?;
        let found = self.gpu.read(counters, slab.counts.clone())?;
        state.counts.copy_from_slice(&found);
        Ok(state)
    }

    fn check_count(&self, deformed: usize) -> Result<(), ResampleError> {
        let rest = self.memory.rest.len();
        if deformed == rest { Ok(()) } else { Err(ResampleError::VertexCount { rest, deformed }) }
    }

    /// Number of threads for `items`; each thread of a kernel may process several items.
    fn threads(&self, items: usize) -> usize {
        items.min(self.gpu.chunk_len(1))
    }

    /// Computes the places at rest and the spans of the removed tets.
    fn rest(&self) -> Result<(), GpuError> {
        let Memory { grid, rest, rest_places, reaches, .. } = &self.memory;
        let Kernels { place, span_removed, .. } = &self.kernels;
        let positions = [(0, grid.whole()), (1, rest.whole()), (2, rest.whole()), (3, rest_places.whole())];
        let positions = self.gpu.bind(place, 0, &positions)?;
        let mesh = self.gpu.bind(
            span_removed,
            0,
            &[(0, grid.whole()), (2, rest_places.whole()), (4, reaches.whole())],
        )?;
        let mut pass = self.gpu.pass("resample: at rest");
        pass.dispatch(place, &[&positions], self.threads(rest.len()));
        for chunk in &self.removed {
            pass.dispatch(span_removed, &[&mesh, &chunk.span], self.threads(chunk.tets.len()));
        }
        pass.submit()
    }

    /// Computes the places of the vertices and the spans of the tets.
    fn place(&self, pass: &mut Pass<'_>, positions: &Buffer<[f32; 4]>) -> Result<(), GpuError> {
        let Memory { grid, rest, places, .. } = &self.memory;
        let Kernels { place, span, .. } = &self.kernels;
        let bound = [(0, grid.whole()), (1, positions.whole()), (2, rest.whole()), (3, places.whole())];
        let bound = self.gpu.bind(place, 0, &bound)?;
        pass.dispatch(place, &[&bound], self.threads(rest.len()));
        for chunk in &self.chunks {
            pass.dispatch(span, &[&self.span_mesh, &chunk.span], self.threads(chunk.tets.len()));
        }
        Ok(())
    }

    /// Runs all passes of a slab.
    fn fill(&self, pass: &mut Pass<'_>, slab: usize) {
        let slab = &self.slabs[slab];
        let Kernels { clear, claim, vacate, gather, .. } = &self.kernels;
        pass.dispatch(clear, &[&slab.clear], self.threads(slab.voxels));
        for chunk in &self.chunks {
            let threads = self.threads(chunk.tets.len());
            claim.dispatch(pass, &slab.claim, &chunk.claim, threads, self.listed);
            vacate.dispatch(pass, &slab.vacate, &chunk.vacate, threads, self.listed);
        }
        for chunk in &self.removed {
            let threads = self.threads(chunk.tets.len());
            vacate.dispatch(pass, &slab.vacate, &chunk.vacate, threads, self.listed);
        }
        for chunk in &self.chunks {
            pass.dispatch(gather, &[&slab.gather, &chunk.gather], self.threads(slab.voxels.div_ceil(2)));
        }
    }

    fn values(&self, slab: &BoundSlab) -> Result<Vec<i16>, GpuError> {
        let words = self.gpu.read(&slab.values, 0..slab.values.len())?;
        let mut values: Vec<i16> =
            words.into_iter().flat_map(|word| [word as i16, (word >> 16) as i16]).collect();
        values.truncate(slab.voxels);
        Ok(values)
    }
}
