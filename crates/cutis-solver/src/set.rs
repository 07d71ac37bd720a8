//! A kind of constraint as backends see it: one virtual call per chunk of a color, never per constraint.

use std::ops::Range;
use std::sync::Arc;

use cutis_constraints::Scalar;
use nalgebra::{Point3, Vector3};

use crate::batch::Project;
use crate::{Residual, Stiffness, Vertex};

/// What a substep asks of every projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step<T> {
    /// PBD.
    Pbd,
    /// XPBD.
    Xpbd {
        /// `1/h²` in 1/s².
        inverse_h_squared: T,
    },
}

/// All constraints of one kind, ordered by color. Implemented by what
/// [`SystemBuilder::add`](crate::SystemBuilder::add) stores, and by nothing else.
pub trait ConstraintSet<T: Scalar>: Project<T> + Send + Sync {
    /// The kind's name, [`Constraint::NAME`](cutis_constraints::Constraint::NAME).
    fn name(&self) -> &'static str;
    /// Vertices of one constraint.
    fn arity(&self) -> usize;
    /// Start of each color, and the end of the last one: `colors + 1` numbers.
    fn offsets(&self) -> &[u32];
    /// The vertices of each constraint, `arity` of them in a row, ordered by color.
    fn indices(&self) -> &[u32];
    /// Scalars of one constraint's parameters.
    fn param_count(&self) -> usize;
    /// The parameters of each constraint, `param_count` scalars in a row, ordered by color.
    fn params(&self) -> &[T];
    /// The size that the value of constraint `k` (in the order of the colors) is compared with.
    ///
    /// # Panics
    /// If there is no such constraint.
    fn rest_size(&self, k: usize) -> T;
    /// The kind in WGSL, [`Constraint::WGSL`](cutis_constraints::Constraint::WGSL).
    fn wgsl(&self) -> &'static str;
    /// Stiffness, ordered by color where there is one for each constraint.
    fn stiffness(&self) -> &Stiffness<T>;
    /// `C` over rest size at the given positions; rest sizes of zero are left out.
    fn residual(&self, vertices: &[Vertex<T>]) -> Residual;
    /// `Σ ½C²/α` in joules over the constraints with `α > 0`; `None` for a PBD stiffness, which stands for no energy.
    fn elastic_energy(&self, vertices: &[Vertex<T>]) -> Option<f64>;
    /// The first constraint (in the order of the colors) that is off by more than `tolerance` of its rest size and cannot
    /// act, because its gradient is zero at every vertex that could move: its index, and its value over its rest size. Rest
    /// sizes of zero are left out, and so are constraints of which no vertex can move.
    fn collapsed(&self, vertices: &[Vertex<T>], tolerance: f64) -> Option<(usize, f64)>;
    /// `C` of constraint `k` (in the order of the colors) in `f64`, with its vertices at `x`; `grad` takes the gradients. For
    /// whoever needs the energies without a solver.
    ///
    /// # Panics
    /// If there is no such constraint, or if `x` or `grad` has not [`arity`](Self::arity) elements.
    fn evaluate(&self, k: usize, x: &[Point3<f64>], grad: &mut [Vector3<f64>]) -> f64;
    /// The same constraints in double precision, with exactly these parameters and stiffnesses.
    fn to_f64(&self) -> Kind<f64>;
    /// Bytes that the kind stores.
    fn bytes(&self) -> usize;

    /// Number of constraints.
    fn len(&self) -> usize {
        self.offsets().last().map_or(0, |&end| end as usize)
    }
    /// Whether there is none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Number of colors.
    fn colors(&self) -> usize {
        self.offsets().len().saturating_sub(1)
    }
    /// The constraints of `color`, as a range over the ordered constraints; empty for a color that does not exist.
    fn range(&self, color: usize) -> Range<usize> {
        match self.offsets().get(color..color.saturating_add(2)) {
            Some(&[start, end]) => start as usize..end as usize,
            _ => 0..0,
        }
    }
}

/// A kind as a system stores it. It never changes, so that copies of a system share it.
pub type Kind<T> = Arc<dyn ConstraintSet<T>>;
