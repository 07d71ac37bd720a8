//! Distribution of passes over threads.

use std::ops::Range;

use cutis_constraints::{Scalar, SimdLevel};
use cutis_solver::{
    Colored, ColoredVertices, ConstraintColor, Execute, Simulation, VertexBlock, VertexColor,
};
use rayon::prelude::*;

/// Number of vertices that a thread processes at a time.
const BLOCK: usize = 8192;

/// Least number of chunks of a color for each thread. With fewer a thread does less work in a color
/// than it takes to wake it.
const CHUNKS_PER_THREAD: usize = 2;

/// Executes passes on the threads of the current pool, or on the calling thread if `threads` is 1.
pub(crate) struct Parallel {
    pub(crate) threads: usize,
    pub(crate) level: SimdLevel,
}

/// Whether a second thread would get work in a pass. Otherwise a step is faster without waking one.
pub(crate) fn is_shared<T: Scalar>(simulation: &Simulation<T>) -> bool {
    let schedule = simulation.schedule();
    let largest = schedule.sweeps.iter().map(|sweep| sweep.end - sweep.start).max().unwrap_or(0);
    largest.div_ceil(Colored::<T>::CHUNK) >= 2 * CHUNKS_PER_THREAD
        || simulation.system().vertices().len() > BLOCK
        || !schedule.color_passes.is_empty()
}

impl<T: Scalar> Execute<T> for Parallel {
    fn workers(&self) -> usize {
        self.threads
    }

    fn vertices(&self, block: VertexBlock<'_, T>, pass: &(dyn Fn(VertexBlock<'_, T>) + Sync)) {
        if self.threads == 1 { pass(block) } else { split(block, pass) }
    }

    fn project(&self, color: ConstraintColor<'_, T>) {
        let color = Colored::new(color, self.level, self.threads);
        let threads = self.threads.min(color.chunks() / CHUNKS_PER_THREAD);
        fan_out(0..threads, &|worker| while color.project_next_chunk(worker) {});
    }

    fn descend(&self, color: VertexColor<'_, T>) {
        let color = ColoredVertices::new(color, self.level);
        fan_out(0..self.threads.min(color.chunks()), &|_| while color.move_next_chunk() {});
    }

    fn find_first(
        &self,
        count: usize,
        find: &(dyn Fn(Range<usize>) -> Option<usize> + Sync),
    ) -> Option<usize> {
        if self.threads == 1 {
            return find(0..count);
        }
        let parts = (0..count.div_ceil(BLOCK)).into_par_iter();
        parts.find_map_first(|k| find(k * BLOCK..count.min((k + 1) * BLOCK)))
    }
}

/// Halves the block until its parts are small. Idle threads take the halves.
fn split<T: Scalar>(block: VertexBlock<'_, T>, pass: &(dyn Fn(VertexBlock<'_, T>) + Sync)) {
    if block.len() <= BLOCK {
        return pass(block);
    }
    let middle = block.len().div_ceil(BLOCK) / 2 * BLOCK;
    let (first, second) = block.split_at(middle);
    rayon::join(|| split(first, pass), || split(second, pass));
}

/// Runs `work` for each worker, on as many threads. `work` returns when no chunk is left.
fn fan_out(workers: Range<usize>, work: &(dyn Fn(usize) + Sync)) {
    if workers.len() <= 1 {
        return work(workers.start);
    }
    let middle = workers.end - workers.len() / 2;
    rayon::join(|| fan_out(workers.start..middle, work), || fan_out(middle..workers.end, work));
}
