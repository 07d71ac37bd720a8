//! Where the equations of a search are solved.

use nalgebra::Vector3;

use crate::conjugate::{self, Solution};
use crate::host::{HostEquations, Vectors};
use crate::matrix::Matrix;
use crate::multigrid::Multigrid;
use crate::{Body, RestError};

/// The place of the equations of a search, and the memory there.
pub(crate) enum Place {
    Host(Vectors),
    #[cfg(feature = "gpu")]
    Gpu(Box<crate::gpu::GpuEquations>),
}

impl Body {
    /// The place of the equations of a search.
    ///
    /// # Errors
    /// `RestError::Gpu` if the vectors do not fit the device, or if it is lost.
    pub(crate) fn place(&self) -> Result<Place, RestError> {
        #[cfg(feature = "gpu")]
        if let Some(gpu) = &self.gpu {
            return Ok(Place::Gpu(Box::new(gpu.equations(self.free.len())?)));
        }
        Ok(Place::Host(Vectors::default()))
    }
}

impl Place {
    /// Drops copies of the levels, because others are built.
    pub fn drop_levels(&mut self) {
        match self {
            Self::Host(_) => {}
            #[cfg(feature = "gpu")]
            Self::Gpu(equations) => equations.drop_levels(),
        }
    }

    /// Solves the equations with a matrix, its levels and a right-hand side.
    ///
    /// # Errors
    /// `RestError::Gpu` if the matrices do not fit the device, or if it is lost.
    pub fn solve(
        &mut self,
        matrix: &Matrix,
        multigrid: &mut Multigrid,
        right: &[Vector3<f64>],
        tolerance: f64,
        most_cycles: usize,
    ) -> Result<Solution, RestError> {
        match self {
            Self::Host(vectors) => {
                let mut equations = HostEquations { matrix, multigrid, vectors };
                conjugate::solve(&mut equations, right, tolerance, most_cycles)
            }
            #[cfg(feature = "gpu")]
            Self::Gpu(equations) => {
                equations.load(matrix, multigrid)?;
                conjugate::solve(&mut **equations, right, tolerance, most_cycles)
            }
        }
    }
}
