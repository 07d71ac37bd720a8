//! A device for searches, and its kernels.

use std::fmt;
use std::sync::Arc;

use cutis_gpu::Gpu;

use super::equations::GpuEquations;
use super::kernels::Kernels;
use crate::RestError;

/// A GPU on which searches solve their equations, with its kernels. Clones share them.
///
/// Give it to a body by [`Body::on_gpu`](crate::Body::on_gpu). A search takes about
/// [`BYTES_PER_VERTEX`](Self::BYTES_PER_VERTEX) on the device, which are freed when it ends. Each of its vectors, with
/// 16 bytes per vertex, must fit a binding: 8.4 million vertices on a device with the baseline of
/// WebGPU. Matrices are split.
///
/// # Agreement
/// The CPU sums in another order, and adds inner products in double precision. So the bits of the
/// steps differ, but both searches end at the same state of rest within their stated errors. On a
/// device the result has the same bits in each run.
///
/// ```
/// use cutis_constraints::Distance;
/// use cutis_gpu::{Gpu, GpuError, GpuOptions};
/// use cutis_rest::{Body, Options, RestGpu};
/// use cutis_solver::{Stiffness, SystemBuilder};
/// use nalgebra::Point3;
///
/// let gpu = match Gpu::open(&GpuOptions::default()) {
///     Err(GpuError::NoAdapter) => return Ok(()), // nothing to run on
///     opened => opened?,
/// };
/// let start = [Point3::new(0.0, 0.0, 0.0), Point3::new(0.0, 0.0, -1.0)];
/// let groups = cutis_coloring::greedy(&[[0, 1]], start.len())?;
/// let system = SystemBuilder::<f64>::new(&start, &[0.0, 1.0])?
///     .add::<Distance, 2>(&[[0, 1]], &[[1.0]], Stiffness::compliance(1.0 / 100.0), &groups)?
///     .build();
/// let body = Body::of(&system, [0.0, 0.0, -9.81])?.on_gpu(&RestGpu::new(&gpu)?);
/// let rest = body.settle(&Options::default(), &mut |_| ())?;
/// assert!((rest.positions[1].z + 1.0981).abs() < 1e-4);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct RestGpu {
    gpu: Gpu,
    kernels: Arc<Kernels>,
}

impl RestGpu {
    /// Memory of a search on the device in bytes per vertex that can move, about.
    pub const BYTES_PER_VERTEX: usize = 1700;

    /// Compiles the kernels for a device.
    ///
    /// # Errors
    /// [`RestError::Gpu`] if the device is lost or rejects a kernel.
    pub fn new(gpu: &Gpu) -> Result<Self, RestError> {
        Self::with_source(gpu, &|source| source)
    }

    /// As [`RestGpu::new`], with the sources of the kernels passed through `change`. Tests use it
    /// to show that they detect a wrong kernel.
    pub(super) fn with_source(gpu: &Gpu, change: &dyn Fn(String) -> String) -> Result<Self, RestError> {
        Ok(Self { gpu: gpu.clone(), kernels: Arc::new(Kernels::new(gpu, change)?) })
    }

    /// The device.
    #[must_use]
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    #[cfg(test)]
    pub(super) fn kernels(&self) -> &Kernels {
        &self.kernels
    }

    /// Memory for equations with this number of nodes.
    pub(crate) fn equations(&self, nodes: usize) -> Result<GpuEquations, RestError> {
        Ok(GpuEquations::new(&self.gpu, &self.kernels, nodes)?)
    }
}

impl fmt::Debug for RestGpu {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("RestGpu").field("gpu", &self.gpu).finish_non_exhaustive()
    }
}
