//! More smoothing where a body is much stiffer than next to it, see `patch.rs` of the crate.

use cutis_gpu::{Buffer, Gpu, GpuError, Pass};

use super::kernels::Kernels;
use super::level::Level;
use super::rows::{OfMatrix, OfNodes};
use super::sliced::{Reads, Sliced};
use super::step::Step;
use crate::matrix::Matrix;
use crate::patch;

/// A patch of the finest level.
pub struct Patch {
    level: Level<3>,
    /// The rows of the finest matrix at the patch and around it.
    rows: Sliced<3, 3>,
    gather: Step,
    scatter: Step,
    residual: Step,
}

impl Patch {
    /// Uploads a patch of a matrix. The level has the right-hand side `right`, the solution `x` and
    /// the residual `residual`.
    ///
    /// # Errors
    /// [`GpuError`] if the device has too little memory or is lost.
    pub fn new(
        gpu: &Gpu,
        kernels: &Kernels,
        matrix: &Matrix,
        patch: &patch::Patch,
        [right, x, residual]: [&Buffer<f32>; 3],
    ) -> Result<Self, GpuError> {
        let vector = |what: &str| gpu.zeroed(&format!("rest: {what} of a patch"), 4 * patch.nodes.len());
        let (own_right, own_x) = (vector("right-hand side")?, vector("solution")?);
        let level = Level::new(gpu, &kernels.fine, &own_rows(patch), &own_right, &own_x)?;
        let rows = Sliced::new(gpu, "rest: rows around a patch", &rows_around(matrix, patch))?;
        let nodes = gpu.buffer("rest: nodes of a patch", &patch.nodes)?;
        let around = gpu.buffer("rest: nodes around a patch", &patch.around)?;
        let gather = [(2, residual.whole()), (3, own_right.whole()), (7, nodes.whole())];
        let scatter = [(0, own_x.whole()), (5, x.whole()), (7, nodes.whole())];
        let rest = [(0, x.whole()), (1, right.whole()), (2, residual.whole()), (7, around.whole())];
        let kernels = &kernels.patch;
        Ok(Self {
            gather: Step::new(gpu, &kernels.gather, &level.matrix, Reads::Rows, &gather)?,
            scatter: Step::new(gpu, &kernels.scatter, &level.matrix, Reads::Rows, &scatter)?,
            residual: Step::new(gpu, &kernels.residual, &rows, Reads::Blocks, &rest)?,
            level,
            rows,
        })
    }

    /// Uploads another matrix with the same columns.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn write(&self, gpu: &Gpu, matrix: &Matrix, patch: &patch::Patch) -> Result<(), GpuError> {
        self.level.write(gpu, &own_rows(patch))?;
        self.rows.write(gpu, &rows_around(matrix, patch))
    }

    /// Smooths the solution of the level at the nodes of the patch, with its residual there.
    pub fn smooth(&self, pass: &mut Pass<'_>) {
        self.gather.run(pass);
        self.level.start(pass);
        (1..patch::ROUNDS).for_each(|_| self.level.smooth(pass));
        self.scatter.run(pass);
    }

    /// Computes the residual of the level at the patch and around it.
    pub fn find_residual(&self, pass: &mut Pass<'_>) {
        self.residual.run(pass);
    }
}

/// The rows and columns of a patch.
fn own_rows(patch: &patch::Patch) -> OfMatrix<'_, Matrix, 3, 4> {
    OfMatrix { matrix: &patch.matrix, smoother: Some(&patch.smoother) }
}

/// The rows of a matrix at a patch and around it.
fn rows_around<'a>(matrix: &'a Matrix, patch: &'a patch::Patch) -> OfNodes<'a> {
    OfNodes { matrix: OfMatrix { matrix, smoother: None }, nodes: &patch.around }
}
