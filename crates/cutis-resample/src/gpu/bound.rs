//! Buffers and bind groups of chunks of tets and of slabs.

use std::ops::Range;

use cutis_gpu::{BindGroup, Buffer, Gpu, GpuError};

use super::kernels::{Kernels, WalkGroups};
use super::memory::{COUNTS, Memory};
use super::uniform::{Chunk, Slab};

/// A chunk of the deformed tets.
pub struct TetChunk {
    pub tets: Buffer<[u32; 4]>,
    spans: Buffer<[u32; 2]>,
    pub span: BindGroup,
    pub claim: WalkGroups,
    pub vacate: WalkGroups,
    pub gather: BindGroup,
}

impl TetChunk {
    /// Uploads `tets`. `first` is the number of the first one among all tets, and `body` of them
    /// belong to the body. `list` and `list + 1` are the lists of large tets of this chunk.
    pub fn new(
        gpu: &Gpu,
        kernels: &Kernels,
        memory: &Memory,
        tets: &[[u32; 4]],
        first: usize,
        body: usize,
        list: usize,
    ) -> Result<Self, GpuError> {
        let buffer = gpu.buffer("resample: tets", tets)?;
        let spans = gpu.zeroed("resample: spans", tets.len())?;
        let claim = chunk(gpu, first, tets.len(), body, list)?;
        let vacate = chunk(gpu, first, tets.len(), body, list + 1)?;
        let Memory { places, rest_places, .. } = memory;
        let (claim, vacate, tets_bound) = (claim.whole(), vacate.whole(), buffer.whole());
        let span = [(0, claim.clone()), (1, tets_bound.clone()), (2, spans.whole())];
        let gather =
            [(0, claim.clone()), (1, tets_bound.clone()), (2, places.whole()), (3, rest_places.whole())];
        let now = [(0, claim), (1, tets_bound.clone()), (3, places.whole())];
        let at_rest = [(0, vacate), (1, tets_bound), (3, rest_places.whole())];
        Ok(Self {
            span: gpu.bind(&kernels.span, 1, &span)?,
            claim: kernels.claim.tets(gpu, &now, &spans)?,
            vacate: kernels.vacate.tets(gpu, &at_rest, &spans)?,
            gather: gpu.bind(&kernels.gather, 1, &gather)?,
            tets: buffer,
            spans,
        })
    }

    pub fn bytes(&self) -> u64 {
        self.tets.bytes() + self.spans.bytes()
    }
}

/// A chunk of removed tets.
pub struct RemovedChunk {
    pub tets: Buffer<[u32; 4]>,
    spans: Buffer<[u32; 2]>,
    pub span: BindGroup,
    pub vacate: WalkGroups,
}

impl RemovedChunk {
    pub fn new(
        gpu: &Gpu,
        kernels: &Kernels,
        memory: &Memory,
        tets: &[[u32; 4]],
        list: usize,
    ) -> Result<Self, GpuError> {
        let buffer = gpu.buffer("resample: removed tets", tets)?;
        let spans = gpu.zeroed("resample: spans of removed tets", tets.len())?;
        let chunk = chunk(gpu, 0, tets.len(), 0, list)?;
        let span = [(0, chunk.whole()), (1, buffer.whole()), (2, spans.whole())];
        let at_rest = [(0, chunk.whole()), (1, buffer.whole()), (3, memory.rest_places.whole())];
        Ok(Self {
            span: gpu.bind(&kernels.span_removed, 1, &span)?,
            vacate: kernels.vacate.tets(gpu, &at_rest, &spans)?,
            tets: buffer,
            spans,
        })
    }

    pub fn bytes(&self) -> u64 {
        self.tets.bytes() + self.spans.bytes()
    }
}

fn chunk(gpu: &Gpu, first: usize, count: usize, body: usize, list: usize) -> Result<Buffer<Chunk>, GpuError> {
    let [first, count, body, list] = [first, count, body, list].map(|n| n as u32);
    gpu.uniform("resample: chunk", &Chunk { first, count, body, list })
}

/// A slab with its output values, two voxels per word.
pub struct BoundSlab {
    pub voxels: usize,
    /// Range of its counts among the counters.
    pub counts: Range<usize>,
    pub values: Buffer<u32>,
    pub clear: BindGroup,
    pub claim: WalkGroups,
    pub vacate: WalkGroups,
    pub gather: BindGroup,
}

impl BoundSlab {
    /// Binds slab `number`, with the given slices of `slice_voxels` voxels each. There are `lists`
    /// lists of large tets.
    pub fn new(
        gpu: &Gpu,
        kernels: &Kernels,
        memory: &Memory,
        number: usize,
        slices: &Range<usize>,
        slice_voxels: usize,
        lists: usize,
    ) -> Result<Self, GpuError> {
        let voxels = slices.len() * slice_voxels;
        let counts = 1 + COUNTS * number..1 + COUNTS * (number + 1);
        let slab = Slab {
            first: slices.start as u32,
            slices: slices.len() as u32,
            voxels: voxels as u32,
            lists: lists as u32,
            counts: counts.start as u32,
            unused: [0; 3],
        };
        let slab = gpu.uniform("resample: slab", &slab)?;
        let values = gpu.zeroed("resample: values", voxels.div_ceil(2))?;
        let Memory { grid, owners, marks, large, reaches, counters, source, .. } = memory;
        let clear = [(0, slab.whole()), (1, owners.whole()), (2, marks.whole()), (3, large.whole())];
        let vacate = [(0, grid.whole()), (1, slab.whole()), (2, marks.whole()), (3, large.whole())];
        let reaches = reaches.whole();
        let claim = [vacate.as_slice(), &[(4, owners.whole())]].concat();
        let gather = [
            (0, grid.whole()),
            (1, slab.whole()),
            (2, owners.whole()),
            (3, marks.whole()),
            (4, counters.whole()),
            (5, values.whole()),
            (6, source.whole()),
            (7, reaches.clone()),
        ];
        Ok(Self {
            voxels,
            counts,
            clear: gpu.bind(&kernels.clear, 0, &clear)?,
            claim: kernels.claim.slab(gpu, &claim, reaches.clone())?,
            vacate: kernels.vacate.slab(gpu, &vacate, reaches)?,
            gather: gpu.bind(&kernels.gather, 0, &gather)?,
            values,
        })
    }
}
