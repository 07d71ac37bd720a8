//! Equations on the device: conjugate gradients with a multigrid cycle.

use std::sync::Arc;

use cutis_gpu::{BindGroup, Buffer, Gpu, GpuError, Kernel, Pass, WORKGROUP};
use cutis_shaders::rest::NODES;
use nalgebra::Vector3;
use rayon::prelude::*;

use super::kernels::Kernels;
use super::level::Level;
use super::levels::Levels;
use super::patch::Patch;
use super::rows::OfMatrix;
use super::sliced::Reads;
use super::step::Step;
use super::uniform::FactorUniform;
use crate::RestError;
use crate::blocks::ROWS;
use crate::conjugate::{Advance, Begin, Equations, Turn};
use crate::host::{scaled, unscaled};
use crate::matrix::Matrix;
use crate::multigrid::Multigrid;

/// Numbers of a node in a vector.
const LANES: usize = 4;

/// Vectors, matrices and levels on a device, which are used again in each step of a search.
pub(crate) struct GpuEquations {
    gpu: Gpu,
    kernels: Arc<Kernels>,
    pub(super) vectors: Vectors,
    factor: Buffer<FactorUniform>,
    /// Inner products of each workgroup.
    shares: Buffer<[f32; 4]>,
    begin: BindGroup,
    advance: BindGroup,
    measure: BindGroup,
    turn: BindGroup,
    /// The finest level, and the product of its matrix. None before the first upload.
    fine: Option<(Level<3>, Step)>,
    /// None if they are not those of the finest level. Its patch is there if they are.
    levels: Option<Levels>,
    patch: Option<Patch>,
}

/// The vectors of conjugate gradients, see [`Equations`].
pub(super) struct Vectors {
    x: Buffer<f32>,
    residual: Buffer<f32>,
    pub z: Buffer<f32>,
    pub z_product: Buffer<f32>,
    direction: Buffer<f32>,
    product: Buffer<f32>,
}

impl GpuEquations {
    /// Memory for the vectors of this number of nodes.
    ///
    /// # Errors
    /// [`GpuError::Limit`] if a vector does not fit a buffer or a binding of the device,
    /// [`GpuError::OutOfMemory`], [`GpuError::Lost`].
    pub fn new(gpu: &Gpu, kernels: &Arc<Kernels>, nodes: usize) -> Result<Self, GpuError> {
        let vector = |what: &str| gpu.zeroed(&format!("rest: {what}"), LANES * nodes);
        let vectors = Vectors {
            x: vector("solution")?,
            residual: vector("right-hand side")?,
            z: vector("preconditioned residual")?,
            z_product: vector("its product")?,
            direction: vector("direction")?,
            product: vector("product")?,
        };
        let Vectors { x, residual, z, z_product, direction, product } = &vectors;
        let factor = gpu.uniform("rest: factor", &FactorUniform::default())?;
        let shares = gpu.zeroed("rest: inner products", nodes.div_ceil(NODES))?;
        let all = [
            factor.whole(),
            x.whole(),
            residual.whole(),
            direction.whole(),
            product.whole(),
            z.whole(),
            z_product.whole(),
            shares.whole(),
        ];
        let bind = |kernel: &Kernel, used: &[u32]| {
            let bindings: Vec<_> = used.iter().map(|&n| (n, all[n as usize].clone())).collect();
            gpu.bind(kernel, 0, &bindings)
        };
        Ok(Self {
            begin: bind(&kernels.vectors.begin, &[1, 2, 3, 4, 5, 6, 7])?,
            advance: bind(&kernels.vectors.advance, &[0, 1, 2, 3, 4])?,
            measure: bind(&kernels.vectors.measure, &[1, 2, 5, 7])?,
            turn: bind(&kernels.vectors.turn, &[0, 3, 4, 5, 6, 7])?,
            gpu: gpu.clone(),
            kernels: kernels.clone(),
            vectors,
            factor,
            shares,
            fine: None,
            levels: None,
            patch: None,
        })
    }

    /// Drops the levels, because others are built.
    pub fn drop_levels(&mut self) {
        self.levels = None;
    }

    /// Uploads a matrix, and its levels if the device has none.
    ///
    /// # Errors
    /// [`GpuError`] if the device has too little memory or is lost.
    pub fn load(&mut self, matrix: &Matrix, multigrid: &Multigrid) -> Result<(), GpuError> {
        let Self { gpu, kernels, vectors: Vectors { residual: right, z, z_product, .. }, .. } = self;
        let rows = OfMatrix { matrix, smoother: multigrid.fine.as_ref().map(|fine| &fine.smoother) };
        // A matrix that is solved directly has no other levels.
        if multigrid.fine.is_none() {
            self.levels = None;
        }
        let fine = match &mut self.fine {
            Some((fine, _)) => {
                fine.write(gpu, &rows)?;
                fine
            }
            none => {
                let fine = Level::new(gpu, &kernels.fine, &rows, right, z)?;
                let vectors = [(0, z.whole()), (3, z_product.whole())];
                let product = Step::new(gpu, &kernels.product, &fine.matrix, Reads::Blocks, &vectors)?;
                &mut none.insert((fine, product)).0
            }
        };
        match (&self.levels, &self.patch, &multigrid.patch) {
            (Some(_), Some(own), Some(patch)) => own.write(gpu, matrix, patch)?,
            (Some(_), ..) => {}
            (None, _, patch) => {
                let vectors = [&*right, &*z, &fine.residual];
                let patch = patch.as_ref().map(|patch| Patch::new(gpu, kernels, matrix, patch, vectors));
                self.patch = patch.transpose()?;
                self.levels = Some(Levels::new(gpu, kernels, multigrid, &fine.residual, [right, z])?);
            }
        }
        Ok(())
    }

    /// Appends a cycle to a pass: from the residual to `z` and its product.
    fn cycle(&self, pass: &mut Pass<'_>) {
        let (Some((fine, product)), Some(levels)) = (&self.fine, &self.levels) else { return };
        let Vectors { residual, z, .. } = &self.vectors;
        let is_smoothed = !levels.is_only_one();
        if is_smoothed {
            fine.start(pass);
        }
        if let Some(patch) = &self.patch {
            patch.smooth(pass);
            patch.find_residual(pass);
        }
        levels.correct(pass, &self.kernels, residual, z);
        if let Some(patch) = &self.patch {
            patch.find_residual(pass);
            patch.smooth(pass);
        }
        if is_smoothed {
            fine.smooth(pass);
        }
        product.run(pass);
    }

    /// Threads of the kernels of `vectors.wgsl`.
    fn threads(&self) -> usize {
        WORKGROUP * self.shares.len()
    }

    fn write_factor(&self, factor: f32) -> Result<(), GpuError> {
        self.gpu.write(&self.factor, 0, &[FactorUniform { factor, unused: [0; 3] }])
    }

    /// Submits a pass, and adds up the inner products of its last kernel.
    fn sums(&self, pass: Pass<'_>) -> Result<[f64; 4], GpuError> {
        pass.submit()?;
        let shares = self.gpu.read(&self.shares, 0..self.shares.len())?;
        let add = |sum: [f64; 4], share: &[f32; 4]| std::array::from_fn(|n| sum[n] + f64::from(share[n]));
        Ok(shares.iter().fold([0.0; 4], add))
    }

    /// The numbers of a vector.
    pub(super) fn read(&self, vector: &Buffer<f32>) -> Result<Vec<f32>, GpuError> {
        self.gpu.read(vector, 0..vector.len())
    }
}

impl Equations for GpuEquations {
    fn begin(&mut self, right: &[Vector3<f64>], largest: f64) -> Result<Begin, RestError> {
        let scaled = |v: &Vector3<f64>| scaled(v, largest);
        let right: Vec<[f32; LANES]> = right.par_iter().with_min_len(ROWS).map(scaled).collect();
        self.gpu.write(&self.vectors.residual, 0, right.as_flattened())?;
        let mut pass = self.gpu.pass("rest: first cycle");
        self.cycle(&mut pass);
        pass.dispatch(&self.kernels.vectors.begin, &[&self.begin], self.threads());
        let [energy, curvature, ..] = self.sums(pass)?;
        Ok(Begin { energy, curvature })
    }

    fn advance(&mut self, length: f32) -> Result<Advance, RestError> {
        self.write_factor(length)?;
        let mut pass = self.gpu.pass("rest: cycle");
        pass.dispatch(&self.kernels.vectors.advance, &[&self.advance], self.threads());
        self.cycle(&mut pass);
        pass.dispatch(&self.kernels.vectors.measure, &[&self.measure], self.threads());
        let [square, energy, ..] = self.sums(pass)?;
        Ok(Advance { square, energy })
    }

    fn turn(&mut self, ratio: f32) -> Result<Turn, RestError> {
        self.write_factor(ratio)?;
        let mut pass = self.gpu.pass("rest: turn");
        pass.dispatch(&self.kernels.vectors.turn, &[&self.turn], self.threads());
        let [square, along, curvature, _] = self.sums(pass)?;
        Ok(Turn { square, along, curvature })
    }

    fn end(&mut self, length: f32, largest: f64) -> Result<Vec<Vector3<f64>>, RestError> {
        self.write_factor(length)?;
        let mut pass = self.gpu.pass("rest: end");
        pass.dispatch(&self.kernels.vectors.advance, &[&self.advance], self.threads());
        pass.submit()?;
        let x = self.read(&self.vectors.x)?;
        let (nodes, _) = x.as_chunks();
        Ok(nodes.par_iter().with_min_len(ROWS).map(|x| unscaled(x, largest)).collect())
    }
}
