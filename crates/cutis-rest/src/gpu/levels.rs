//! All levels below the finest one.

use cutis_gpu::{Buffer, Gpu, GpuError, Pass};

use super::bottom::Bottom;
use super::kernels::Kernels;
use super::level::{Level, Way};
use super::rows::OfMatrix;
use crate::multigrid::{self, LANES, Multigrid, RIGID};

/// The way down from the finest level, and the levels there.
pub struct Levels {
    /// The way to each level.
    ways: Vec<Way>,
    levels: Vec<Level<RIGID>>,
    /// The last level, with its right-hand side and solution. None if they are the finest ones.
    bottom: Bottom,
    ends: Option<[Buffer<f32>; 2]>,
}

/// What is on a level before its matrix: where it reads and writes.
struct Vectors {
    right: Buffer<f32>,
    x: Buffer<f32>,
}

impl Levels {
    /// Uploads the levels below the finest one, whose solution for `right` goes to `x`. `residual`
    /// is that of its smoother.
    ///
    /// # Errors
    /// [`GpuError`] if the device has too little memory or is lost.
    pub fn new(
        gpu: &Gpu,
        kernels: &Kernels,
        multigrid: &Multigrid,
        residual: &Buffer<f32>,
        [right, x]: [&Buffer<f32>; 2],
    ) -> Result<Self, GpuError> {
        let Some(fine) = &multigrid.fine else {
            let bottom = Bottom::new(gpu, kernels, &multigrid.bottom, [3, 4], right, x)?;
            return Ok(Self { ways: Vec::new(), levels: Vec::new(), bottom, ends: None });
        };
        let vectors = |nodes: usize| {
            let vector = |what: &str| gpu.zeroed(&format!("rest: {what} of a level"), LANES * nodes);
            Ok::<_, GpuError>(Vectors { right: vector("right-hand side")?, x: vector("solution")? })
        };
        let mut below = vectors(fine.transfer.width())?;
        let (down, up) = ([residual, &below.right], [&below.x, x]);
        let mut ways = vec![Way::new(gpu, &kernels.from_fine, &fine.transfer, down, up)?];
        let mut levels = Vec::new();
        for multigrid::Coarse { matrix, level } in &multigrid.coarse {
            let rows = OfMatrix { matrix, smoother: Some(&level.smoother) };
            let own = Level::new(gpu, &kernels.coarse, &rows, &below.right, &below.x)?;
            let next = vectors(level.transfer.width())?;
            let (down, up) = ([&own.residual, &next.right], [&next.x, &below.x]);
            ways.push(Way::new(gpu, &kernels.from_coarse, &level.transfer, down, up)?);
            levels.push(own);
            below = next;
        }
        let Vectors { right, x } = below;
        let bottom = Bottom::new(gpu, kernels, &multigrid.bottom, [RIGID, LANES], &right, &x)?;
        Ok(Self { ways, levels, bottom, ends: Some([right, x]) })
    }

    /// Whether the finest level is the only one, which is solved directly.
    pub fn is_only_one(&self) -> bool {
        self.ways.is_empty()
    }

    /// Solves for the residual of the finest level approximately, and adds the result to its
    /// solution. `right` and `x` are those of the finest level.
    pub fn correct(&self, pass: &mut Pass<'_>, kernels: &Kernels, right: &Buffer<f32>, x: &Buffer<f32>) {
        let mut ways = self.ways.iter();
        if let Some(way) = ways.next() {
            way.restriction.run(pass);
        }
        for (level, way) in self.levels.iter().zip(ways) {
            level.start(pass);
            way.restriction.run(pass);
        }
        let [right, x] = self.ends.as_ref().map_or([right, x], |[right, x]| [right, x]);
        self.bottom.solve(pass, kernels, right, x);
        for (level, way) in self.levels.iter().zip(self.ways.iter().skip(1)).rev() {
            way.prolongation.run(pass);
            level.smooth(pass);
        }
        if let Some(way) = self.ways.first() {
            way.prolongation.run(pass);
        }
    }
}
