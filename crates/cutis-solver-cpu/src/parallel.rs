//! How passes are spread over threads.

use cutis_constraints::Scalar;
use cutis_solver::{Colored, ColoredVertices, ConstraintSet, Execute, Step, Sweep, Vertex, VertexBlock};
use rayon::prelude::*;

/// Vertices that a thread takes at a time.
const BLOCK: usize = 8192;

/// Executes passes on the threads of the pool that the caller runs in, or alone when `threads` is 1.
pub(crate) struct Parallel {
    pub(crate) threads: usize,
}

impl<T: Scalar> Execute<T> for Parallel {
    fn vertices(&self, block: VertexBlock<'_, T>, pass: &(dyn Fn(VertexBlock<'_, T>) + Sync)) {
        if self.threads == 1 { pass(block) } else { spread(block, pass) }
    }

    fn sweep(
        &self,
        sweep: Sweep,
        set: &dyn ConstraintSet<T>,
        vertices: &mut [Vertex<T>],
        step: Step<T>,
        multipliers: &mut [T],
    ) {
        let color = Colored::new(vertices, set, sweep.color, step, multipliers);
        fan_out(self.threads.min(color.chunks()), &|| while color.project_next_chunk() {});
    }

    fn color_pass(&self, color: ColoredVertices<'_, T>) {
        fan_out(self.threads.min(color.chunks()), &|| while color.move_next_chunk() {});
    }

    fn first_not_finite(&self, vertices: &[Vertex<T>]) -> Option<usize> {
        let first = |part: &[Vertex<T>]| part.iter().position(|vertex| !vertex.is_finite());
        if self.threads == 1 {
            return first(vertices);
        }
        let parts = vertices.par_chunks(BLOCK).enumerate();
        parts.find_map_first(|(k, part)| Some(k * BLOCK + first(part)?))
    }
}

/// Halves the block until its parts are small, and lets idle threads take the halves.
fn spread<T: Scalar>(block: VertexBlock<'_, T>, pass: &(dyn Fn(VertexBlock<'_, T>) + Sync)) {
    if block.len() <= BLOCK {
        return pass(block);
    }
    let middle = block.len().div_ceil(BLOCK) / 2 * BLOCK;
    let (first, second) = block.split_at(middle);
    rayon::join(|| spread(first, pass), || spread(second, pass));
}

/// Lets `threads` threads run `work`, which returns when there is nothing left to take.
fn fan_out(threads: usize, work: &(dyn Fn() + Sync)) {
    if threads <= 1 {
        return work();
    }
    let half = threads / 2;
    rayon::join(|| fan_out(threads - half, work), || fan_out(half, work));
}
