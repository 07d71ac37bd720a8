//! The kernels of a device.

use std::sync::Arc;

use cutis_gpu::{Gpu, GpuError, Kernel};
use cutis_shaders::rest::{self as shaders, Unknowns};

/// All kernels.
pub struct Kernels {
    /// Smoothing on the finest level, and on the others.
    pub fine: Smoothing,
    pub coarse: Smoothing,
    /// The product with the finest matrix.
    pub product: Arc<Kernel>,
    pub patch: Patch,
    /// The ways from the finest level to the next one and back, and from the others.
    pub from_fine: Transfer,
    pub from_coarse: Transfer,
    /// The product with a dense matrix.
    pub times: Arc<Kernel>,
    pub vectors: Vectors,
}

/// The stages of smoothing.
pub struct Smoothing {
    pub start: Arc<Kernel>,
    pub first: Arc<Kernel>,
    pub second: Arc<Kernel>,
    pub third: Arc<Kernel>,
}

/// The way between the finest level and a patch of it.
pub struct Patch {
    pub gather: Arc<Kernel>,
    pub scatter: Arc<Kernel>,
    pub residual: Arc<Kernel>,
}

/// The way between two levels.
pub struct Transfer {
    pub restriction: Arc<Kernel>,
    pub prolongation: Arc<Kernel>,
}

/// The steps of conjugate gradients.
pub struct Vectors {
    pub begin: Arc<Kernel>,
    pub advance: Arc<Kernel>,
    pub measure: Arc<Kernel>,
    pub turn: Arc<Kernel>,
}

impl Kernels {
    /// Compiles all kernels. Their sources are passed through `change`.
    pub fn new(gpu: &Gpu, change: &dyn Fn(String) -> String) -> Result<Self, GpuError> {
        let kernel =
            |source: &str, entry: &str| Ok(Arc::new(gpu.kernel(&format!("rest: {entry}"), source, entry)?));
        let smooth = |unknowns: Unknowns| change(shaders::smooth(unknowns));
        let smoothing = |source: &str| {
            Ok::<_, GpuError>(Smoothing {
                start: kernel(source, shaders::START)?,
                first: kernel(source, shaders::FIRST)?,
                second: kernel(source, shaders::SECOND)?,
                third: kernel(source, shaders::THIRD)?,
            })
        };
        let transfer = |unknowns: Unknowns| {
            let down = change(shaders::transfer(Unknowns::Six, unknowns));
            let up = change(shaders::transfer(unknowns, Unknowns::Six));
            Ok::<_, GpuError>(Transfer {
                restriction: kernel(&down, shaders::RESTRICT)?,
                prolongation: kernel(&up, shaders::PROLONG)?,
            })
        };
        let (fine, vectors) = (smooth(Unknowns::Three), change(shaders::vectors()));
        Ok(Self {
            fine: smoothing(&fine)?,
            coarse: smoothing(&smooth(Unknowns::Six))?,
            product: kernel(&fine, shaders::PRODUCT)?,
            patch: Patch {
                gather: kernel(&fine, shaders::GATHER)?,
                scatter: kernel(&fine, shaders::SCATTER)?,
                residual: kernel(&fine, shaders::RESIDUAL)?,
            },
            from_fine: transfer(Unknowns::Three)?,
            from_coarse: transfer(Unknowns::Six)?,
            times: kernel(&change(shaders::dense()), shaders::TIMES)?,
            vectors: Vectors {
                begin: kernel(&vectors, shaders::BEGIN)?,
                advance: kernel(&vectors, shaders::ADVANCE)?,
                measure: kernel(&vectors, shaders::MEASURE)?,
                turn: kernel(&vectors, shaders::TURN)?,
            },
        })
    }
}
