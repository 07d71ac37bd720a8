//! Sparse matrices in slices on the device, see `sliced.wgsl`.

use std::ops::Range;

use cutis_gpu::{BindGroup, Buffer, Gpu, GpuError, Kernel, WORKGROUP};
use rayon::prelude::*;

use super::rows::Rows;
use super::uniform::ChunkUniform;
use crate::blocks::divided;

/// Largest number of numbers in a part of a matrix, so that the host needs little memory to upload
/// it.
const MOST_NUMBERS: usize = 32 << 20;
/// Slices that a thread of the host takes at once.
const SLICES: usize = 16;

/// What a kernel reads of a matrix.
#[derive(Clone, Copy, Debug)]
pub enum Reads {
    /// Only where its rows are.
    Rows,
    /// The blocks of a node itself.
    Own,
    /// All blocks.
    Blocks,
}

/// A matrix of blocks with `R` rows and `C` columns.
pub struct Sliced<const R: usize, const C: usize> {
    chunks: Vec<Chunk>,
    /// The first block of each slice, and the end of the last one. A block counts once for all rows
    /// of its slice.
    starts: Vec<usize>,
}

/// Slices that share one set of buffers.
struct Chunk {
    slices: Range<usize>,
    uniform: Buffer<ChunkUniform>,
    starts: Buffer<u32>,
    columns: Buffer<u32>,
    values: Buffer<f32>,
}

/// Rows of blocks in a slice, one for each `R` threads and the padding of a vector.
const fn rows_of_slice(unknowns: usize) -> usize {
    WORKGROUP / unknowns.next_multiple_of(4)
}

impl<const R: usize, const C: usize> Sliced<R, C> {
    const ROWS: usize = rows_of_slice(R);
    /// Unknowns of a slice.
    const HEIGHT: usize = R * Self::ROWS;

    /// Uploads a matrix, in parts that the device can bind.
    ///
    /// # Errors
    /// [`GpuError`] if the device has too little memory, cannot bind one slice, or is lost.
    pub fn new(gpu: &Gpu, label: &str, matrix: &impl Rows<R, C>) -> Result<Self, GpuError> {
        let count = matrix.count().div_ceil(Self::ROWS);
        let longest = |slice: usize| rows(slice, Self::ROWS, matrix).map(|row| matrix.blocks(row)).max();
        let lengths: Vec<usize> =
            (0..count).into_par_iter().with_min_len(SLICES).map(|n| longest(n).unwrap_or(0)).collect();
        let mut starts = Vec::with_capacity(count + 1);
        starts.push(0);
        for (n, length) in lengths.into_iter().enumerate() {
            starts.push(starts[n] + length);
        }
        let chunks = Self::divided(gpu, &starts)
            .into_iter()
            .map(|slices| {
                let own = &starts[slices.start..=slices.end];
                let from = own[0];
                let blocks = own[own.len() - 1] - from;
                let (first, count) = (slices.start as u32, matrix.count() as u32);
                let uniform = ChunkUniform { first, rows: count, unused: [0; 2] };
                let own: Vec<u32> = own.iter().map(|start| (start - from) as u32).collect();
                Ok(Chunk {
                    uniform: gpu.uniform(label, &uniform)?,
                    starts: gpu.buffer(label, &own)?,
                    columns: gpu.buffer(label, &Self::columns(&starts, &slices, matrix))?,
                    values: gpu.zeroed(label, blocks * C * Self::HEIGHT)?,
                    slices,
                })
            })
            .collect::<Result<_, GpuError>>()?;
        let sliced = Self { chunks, starts };
        sliced.write(gpu, matrix)?;
        Ok(sliced)
    }

    /// Slices in parts that the device can bind and run, with at least one slice each.
    fn divided(gpu: &Gpu, starts: &[usize]) -> Vec<Range<usize>> {
        let numbers = C * Self::HEIGHT;
        let most_blocks = gpu.binding_len(numbers * size_of::<f32>()).min(MOST_NUMBERS / numbers);
        let most_slices = (gpu.limits().max_workgroups as usize).min(gpu.binding_len(size_of::<u32>()));
        let (count, mut first) = (starts.len() - 1, 0);
        let mut parts = Vec::new();
        while first < count {
            let fits = |slice: &usize| {
                starts[slice + 1] - starts[first] <= most_blocks && slice - first < most_slices
            };
            let end = (first + 1..count).find(|slice| !fits(slice)).unwrap_or(count);
            parts.push(first..end);
            first = end;
        }
        parts
    }

    /// The columns of the blocks of some slices. A block of zeros has the last column of its row.
    fn columns(starts: &[usize], slices: &Range<usize>, matrix: &impl Rows<R, C>) -> Vec<u32> {
        let lengths = || slices.clone().map(|slice| starts[slice + 1] - starts[slice]);
        let mut columns = vec![0; Self::ROWS * lengths().sum::<usize>()];
        let pieces = divided(&mut columns, lengths().map(|length| Self::ROWS * length));
        pieces.into_par_iter().zip(slices.clone()).with_min_len(SLICES).for_each(|(to, slice)| {
            for (n, row) in rows(slice, Self::ROWS, matrix).enumerate() {
                let (mut block, mut last) = (0, 0);
                matrix.for_each(row, |column, _| {
                    last = column as u32;
                    to[Self::ROWS * block + n] = last;
                    block += 1;
                });
                to.iter_mut().skip(n).step_by(Self::ROWS).skip(block).for_each(|to| *to = last);
            }
        });
        columns
    }

    /// Uploads the blocks of a matrix with the same columns.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn write(&self, gpu: &Gpu, matrix: &impl Rows<R, C>) -> Result<(), GpuError> {
        let mut values = Vec::new();
        for chunk in &self.chunks {
            values.clear();
            values.resize(chunk.values.len(), 0.0);
            let length = |slice: usize| C * Self::HEIGHT * (self.starts[slice + 1] - self.starts[slice]);
            let pieces = divided(&mut values, chunk.slices.clone().map(length));
            let slices = pieces.into_par_iter().zip(chunk.slices.clone()).with_min_len(SLICES);
            slices.for_each(|(to, slice)| {
                for (n, row) in rows(slice, Self::ROWS, matrix).enumerate() {
                    let mut columns = to.chunks_exact_mut(Self::HEIGHT);
                    matrix.for_each(row, |_, block| {
                        for (from, to) in block.iter().zip(&mut columns) {
                            let own = &mut to[R * n..R * (n + 1)];
                            own.iter_mut().zip(from).for_each(|(to, &from)| *to = from as f32);
                        }
                    });
                }
            });
            gpu.write(&chunk.values, 0, &values)?;
        }
        Ok(())
    }

    /// Group 0 of a kernel for each part, and the threads that it needs.
    ///
    /// # Errors
    /// [`GpuError`] if the device is lost.
    pub fn bind(
        &self,
        gpu: &Gpu,
        kernel: &Kernel,
        reads: Reads,
    ) -> Result<Vec<(BindGroup, usize)>, GpuError> {
        let bind = |chunk: &Chunk| {
            let all = [
                (0, chunk.uniform.whole()),
                (1, chunk.starts.whole()),
                (3, chunk.values.whole()),
                (2, chunk.columns.whole()),
            ];
            let used = match reads {
                Reads::Rows => &all[..1],
                Reads::Own => &all[..3],
                Reads::Blocks => &all[..],
            };
            Ok((gpu.bind(kernel, 0, used)?, WORKGROUP * chunk.slices.len()))
        };
        self.chunks.iter().map(bind).collect()
    }

    /// Number of parts.
    #[cfg(test)]
    pub fn parts(&self) -> usize {
        self.chunks.len()
    }
}

/// The rows of a slice.
fn rows<const R: usize, const C: usize>(
    slice: usize,
    height: usize,
    matrix: &impl Rows<R, C>,
) -> Range<usize> {
    slice * height..((slice + 1) * height).min(matrix.count())
}
