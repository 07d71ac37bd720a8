//! A kernel with a matrix and vectors, ready to run.

use std::sync::Arc;

use cutis_gpu::{BindGroup, Binding, Gpu, GpuError, Kernel, Pass};

use super::sliced::{Reads, Sliced};

/// A kernel of `smooth.wgsl` or `transfer.wgsl` with what it reads and writes.
pub struct Step {
    kernel: Arc<Kernel>,
    /// Group 0 and the threads for each part of the matrix.
    parts: Vec<(BindGroup, usize)>,
    vectors: BindGroup,
}

impl Step {
    /// A step with the rows of a matrix. `vectors` are those of group 1.
    ///
    /// # Errors
    /// [`GpuError::Limit`] if a vector does not fit a binding, [`GpuError::Lost`].
    pub fn new<const R: usize, const C: usize>(
        gpu: &Gpu,
        kernel: &Arc<Kernel>,
        matrix: &Sliced<R, C>,
        reads: Reads,
        vectors: &[(u32, Binding<'_>)],
    ) -> Result<Self, GpuError> {
        let vectors = gpu.bind(kernel, 1, vectors)?;
        Ok(Self { kernel: kernel.clone(), parts: matrix.bind(gpu, kernel, reads)?, vectors })
    }

    /// Appends the step to a pass.
    pub fn run(&self, pass: &mut Pass<'_>) {
        for (part, threads) in &self.parts {
            pass.dispatch(&self.kernel, &[part, &self.vectors], *threads);
        }
    }
}
