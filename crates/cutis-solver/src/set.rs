//! The interface of a kind of constraint to backends, with one virtual call per chunk of a color.

use std::ops::Range;
use std::sync::Arc;

use cutis_constraints::Scalar;
use nalgebra::{Point3, Vector3};

use crate::batch::Project;
use crate::{Residual, Stiffness, Vertex};

/// Parameters of a substep for every projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step<T> {
    /// PBD, which needs no parameter.
    Pbd,
    /// XPBD with its time step.
    Xpbd {
        /// `1/h²` in 1/s².
        inverse_h_squared: T,
    },
}

/// All constraints of one kind, ordered by color.
///
/// Only the type that [`SystemBuilder::add`](crate::SystemBuilder::add) stores implements this
/// trait. Indices `k` of constraints count in the order of the colors.
pub trait ConstraintSet<T: Scalar>: Project<T> + Send + Sync {
    /// Returns the name of the kind, [`Constraint::NAME`](cutis_constraints::Constraint::NAME).
    fn name(&self) -> &'static str;
    /// Returns the number of vertices of one constraint.
    fn arity(&self) -> usize;
    /// Returns the start of each color and the end of the last one: `colors + 1` numbers.
    fn offsets(&self) -> &[u32];
    /// Returns the number of tiles. A backend may project all colors of the first tile, then those
    /// of the second one, and so on, with the bits of a sweep over whole colors. The vertices of a
    /// tile stay in the cache of a processor.
    fn tiles(&self) -> usize;
    /// Returns the constraints of `color` in `tile` as a range of indices. The range is empty for a
    /// color or a tile that does not exist.
    fn part(&self, color: usize, tile: usize) -> Range<usize>;
    /// Returns the number of constraints that are in long enough rows of constraints whose vertices
    /// advance by two. SIMD lanes read them fastest from [`Columns`](crate::Columns).
    fn constraints_in_rows(&self) -> usize;
    /// Returns the vertices of all constraints, `arity` of them in a row.
    fn indices(&self) -> &[u32];
    /// Returns the number of parameters of one constraint.
    fn param_count(&self) -> usize;
    /// Returns the parameters of all constraints, `param_count` scalars in a row.
    fn params(&self) -> &[T];
    /// Returns the rest size of constraint `k`, to which its value is compared.
    ///
    /// # Panics
    /// Panics if there is no such constraint.
    fn rest_size(&self, k: usize) -> T;
    /// Returns the WGSL source of the kind,
    /// [`Constraint::WGSL`](cutis_constraints::Constraint::WGSL).
    fn wgsl(&self) -> &'static str;
    /// Returns the stiffness, with values per constraint in the order of the colors.
    fn stiffness(&self) -> &Stiffness<T>;
    /// Returns `C` over the rest size at the given positions. Constraints with a rest size of zero
    /// do not count.
    fn residual(&self, vertices: &[Vertex<T>]) -> Residual;
    /// Returns `Σ ½C²/α` in joules over the constraints with `α > 0`, or `None` for a PBD
    /// stiffness, which defines no energy.
    fn elastic_energy(&self, vertices: &[Vertex<T>]) -> Option<f64>;
    /// Finds the first constraint that is violated by more than `tolerance` of its rest size but
    /// cannot act, because its gradient is zero at every vertex that can move. Returns its index
    /// and its value over its rest size. Constraints with a rest size of zero or without a vertex
    /// that can move do not count.
    fn collapsed(&self, vertices: &[Vertex<T>], tolerance: f64) -> Option<(usize, f64)>;
    /// Returns `C` of constraint `k` in `f64` with its vertices at `x`, and writes the gradients to
    /// `grad`. Use it to compute energies and forces without a solver.
    ///
    /// # Panics
    /// Panics if there is no such constraint, or if `x` or `grad` does not have
    /// [`arity`](Self::arity) elements.
    fn evaluate(&self, k: usize, x: &[Point3<f64>], grad: &mut [Vector3<f64>]) -> f64;
    /// Evaluates some constraints as [`evaluate`](Self::evaluate) does, with one virtual call for
    /// all of them. `x` and `grad` have the vertices of one constraint after the other, and `c` has
    /// one value per constraint.
    ///
    /// # Panics
    /// Panics if there is no such constraint, or if the lengths do not fit.
    fn evaluate_all(&self, constraints: &[u32], x: &[Point3<f64>], c: &mut [f64], grad: &mut [Vector3<f64>]);
    /// Returns the same constraints in double precision, with exactly these parameters and
    /// stiffnesses.
    fn to_f64(&self) -> Kind<f64>;
    /// Returns the memory of the kind in bytes.
    fn bytes(&self) -> usize;

    /// Returns the number of constraints.
    fn len(&self) -> usize {
        self.offsets().last().map_or(0, |&end| end as usize)
    }
    /// True if there are no constraints.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Returns the number of colors.
    fn colors(&self) -> usize {
        self.offsets().len().saturating_sub(1)
    }
    /// Returns the constraints of `color` as a range of indices. The range is empty for a color
    /// that does not exist.
    fn range(&self, color: usize) -> Range<usize> {
        match self.offsets().get(color..color.saturating_add(2)) {
            Some(&[start, end]) => start as usize..end as usize,
            _ => 0..0,
        }
    }
}

/// A kind of constraint as a system stores it. It never changes, so that clones of a system share
/// it.
pub type Kind<T> = Arc<dyn ConstraintSet<T>>;
