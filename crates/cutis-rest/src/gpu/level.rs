//! Smoothing on a level, and the way to the next one.

use cutis_gpu::{Buffer, Gpu, GpuError, Pass};

use super::kernels::{Smoothing, Transfer};
use super::rows::{OfMatrix, Own, Prolongation, Restriction};
use super::sliced::{Reads, Sliced};
use super::step::Step;
use super::uniform::FactorsUniform;
use crate::multigrid::RIGID;
use crate::smoother::{Operator, Smoother};
use crate::sweep::Factors;
use crate::transfer;

/// A matrix and the vectors of its smoother.
pub struct Level<const B: usize> {
    pub matrix: Sliced<B, B>,
    /// The residual of the solution.
    pub residual: Buffer<f32>,
    /// Factors of the stages from zero, and of those from an approximation.
    factors: [Buffer<FactorsUniform>; 7],
    /// The stages from zero, and from an approximation.
    start: [Step; 4],
    smooth: [Step; 3],
}

impl<const B: usize> Level<B> {
    /// Uploads a matrix. The level solves for the right-hand side `right` and writes to `x`.
    ///
    /// # Errors
    /// [`GpuError`] if the device has too little memory or is lost.
    pub fn new<const L: usize, M: Operator<B, L> + Own<B>>(
        gpu: &Gpu,
        kernels: &Smoothing,
        rows: &OfMatrix<'_, M, B, L>,
        right: &Buffer<f32>,
        x: &Buffer<f32>,
    ) -> Result<Self, GpuError> {
        let matrix = Sliced::new(gpu, &format!("rest: matrix with {B} unknowns"), rows)?;
        let vector = |what: &str| gpu.zeroed(&format!("rest: {what}"), right.len());
        let (residual, one, two) = (vector("residual")?, vector("first change")?, vector("second change")?);
        let none = FactorsUniform::default();
        let factors = [(); 7].map(|()| gpu.uniform("rest: factors", &none));
        let [a, b, c, d, e, f, g] = factors;
        let factors = [a?, b?, c?, d?, e?, f?, g?];
        let start = |factors: &Buffer<_>| {
            let vectors = [(1, right.whole()), (5, x.whole()), (6, factors.whole())];
            Step::new(gpu, &kernels.start, &matrix, Reads::Own, &vectors)
        };
        let first = |factors: &Buffer<_>| {
            let vectors = [(0, x.whole()), (1, right.whole()), (2, residual.whole()), (3, one.whole())];
            let vectors = [&vectors[..], &[(6, factors.whole())]].concat();
            Step::new(gpu, &kernels.first, &matrix, Reads::Blocks, &vectors)
        };
        let second = |factors: &Buffer<_>| {
            let vectors = [(0, one.whole()), (2, residual.whole()), (3, two.whole()), (6, factors.whole())];
            Step::new(gpu, &kernels.second, &matrix, Reads::Blocks, &vectors)
        };
        let third = |factors: &Buffer<_>| {
            let vectors = [(0, two.whole()), (2, residual.whole()), (4, one.whole()), (5, x.whole())];
            let vectors = [&vectors[..], &[(6, factors.whole())]].concat();
            Step::new(gpu, &kernels.third, &matrix, Reads::Blocks, &vectors)
        };
        let [f0, f1, f2, f3, f4, f5, f6] = &factors;
        let (start, smooth) =
            ([start(f0)?, first(f1)?, second(f2)?, third(f3)?], [first(f4)?, second(f5)?, third(f6)?]);
        let level = Self { matrix, residual, factors, start, smooth };
        level.write_factors(gpu, rows.smoother)?;
        Ok(level)
    }

    /// Uploads another matrix with the same columns, and the factors of its smoother.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn write<const L: usize, M: Operator<B, L> + Own<B>>(
        &self,
        gpu: &Gpu,
        rows: &OfMatrix<'_, M, B, L>,
    ) -> Result<(), GpuError> {
        self.matrix.write(gpu, rows)?;
        self.write_factors(gpu, rows.smoother)
    }

    fn write_factors<const L: usize>(
        &self,
        gpu: &Gpu,
        smoother: Option<&Smoother<B, L>>,
    ) -> Result<(), GpuError> {
        let Some(smoother) = smoother else { return Ok(()) };
        let [one, two, three] = smoother.factors();
        let of_stages = [(0.0, one.1), two, three, (0.0, 0.0), one, two, three];
        for (buffer, (old, step)) in self.factors.iter().zip::<[Factors; 7]>(of_stages) {
            gpu.write(buffer, 0, &[FactorsUniform { old, step, unused: [0; 2] }])?;
        }
        Ok(())
    }

    /// Smooths from zero, and writes the residual.
    pub fn start(&self, pass: &mut Pass<'_>) {
        self.start.iter().for_each(|step| step.run(pass));
    }

    /// Smooths the approximation in `x`.
    pub fn smooth(&self, pass: &mut Pass<'_>) {
        self.smooth.iter().for_each(|step| step.run(pass));
    }
}

/// The way from a level to the next one, and back.
pub struct Way {
    pub restriction: Step,
    pub prolongation: Step,
}

impl Way {
    /// Uploads a prolongation and its transposed matrix. The restriction of `residual` goes to
    /// `right`, and the prolongation of `coarse` is added to `x`.
    ///
    /// # Errors
    /// [`GpuError`] if the device has too little memory or is lost.
    pub fn new<const B: usize>(
        gpu: &Gpu,
        kernels: &Transfer,
        transfer: &transfer::Transfer<B>,
        [residual, right]: [&Buffer<f32>; 2],
        [coarse, x]: [&Buffer<f32>; 2],
    ) -> Result<Self, GpuError> {
        let blocks = &transfer.prolongation;
        let restriction = Sliced::<RIGID, B>::new(gpu, "rest: restriction", &Restriction::of(blocks))?;
        let prolongation = Sliced::<B, RIGID>::new(gpu, "rest: prolongation", &Prolongation(blocks))?;
        let down = [(0, residual.whole()), (1, right.whole())];
        let up = [(0, coarse.whole()), (1, x.whole())];
        Ok(Self {
            restriction: Step::new(gpu, &kernels.restriction, &restriction, Reads::Blocks, &down)?,
            prolongation: Step::new(gpu, &kernels.prolongation, &prolongation, Reads::Blocks, &up)?,
        })
    }
}
