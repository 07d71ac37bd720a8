//! The solution of the equations of a search for the state of rest: smoothing, the way between
//! levels, the solution on the last level, and the vectors of conjugate gradients.

use crate::link;

const SLICED: &str = include_str!("../wgsl/rest/sliced.wgsl");
const SMOOTH: &str = include_str!("../wgsl/rest/smooth.wgsl");
const TRANSFER: &str = include_str!("../wgsl/rest/transfer.wgsl");

/// Name of the entry point of [`smooth`] that begins at zero.
pub const START: &str = "start";
/// Name of the entry point of [`smooth`] that computes the residual and the first change.
pub const FIRST: &str = "first";
/// Name of the entry point of [`smooth`] that computes the second change.
pub const SECOND: &str = "second";
/// Name of the entry point of [`smooth`] that adds all changes to the solution.
pub const THIRD: &str = "third";
/// Name of the entry point of [`smooth`] that computes a product.
pub const PRODUCT: &str = "product";
/// Name of the entry point of [`smooth`] that reads the residual at the nodes of a patch.
pub const GATHER: &str = "gather";
/// Name of the entry point of [`smooth`] that adds the solution of a patch.
pub const SCATTER: &str = "scatter";
/// Name of the entry point of [`smooth`] that computes the residual at some nodes.
pub const RESIDUAL: &str = "residual_at_nodes";
/// Name of the entry point of [`transfer`] that goes to the next level.
pub const RESTRICT: &str = "restriction";
/// Name of the entry point of [`transfer`] that comes back from it.
pub const PROLONG: &str = "prolongation";
/// Name of the entry point of [`dense`].
pub const TIMES: &str = "times";
/// Name of the entry point of [`vectors`] that begins at zero.
pub const BEGIN: &str = "begin";
/// Name of the entry point of [`vectors`] that moves along the direction.
pub const ADVANCE: &str = "advance";
/// Name of the entry point of [`vectors`] for the inner products after a cycle.
pub const MEASURE: &str = "measure";
/// Name of the entry point of [`vectors`] that turns the direction.
pub const TURN: &str = "turn";
/// Nodes that a workgroup of [`vectors`] takes.
pub const NODES: usize = 1024;

/// The unknowns of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unknowns {
    /// A displacement: the finest level.
    Three,
    /// The motion of a rigid body: the other levels.
    Six,
}

impl Unknowns {
    /// Number of unknowns of a node.
    pub const fn count(self) -> usize {
        match self {
            Self::Three => 3,
            Self::Six => 6,
        }
    }

    /// Numbers of a node in a vector: the unknowns, and zeros to a multiple of four.
    pub const fn lanes(self) -> usize {
        match self {
            Self::Three => 4,
            Self::Six => 8,
        }
    }

    /// Constants for the rows of a matrix.
    fn of_rows(self) -> &'static str {
        match self {
            Self::Three => include_str!("../wgsl/rest/rows_3.wgsl"),
            Self::Six => include_str!("../wgsl/rest/rows_6.wgsl"),
        }
    }

    /// Access to the columns of a matrix.
    fn of_columns(self) -> &'static str {
        match self {
            Self::Three => include_str!("../wgsl/rest/columns_3.wgsl"),
            Self::Six => include_str!("../wgsl/rest/columns_6.wgsl"),
        }
    }
}

/// Returns the source that smooths on a level with these unknowns.
pub fn smooth(unknowns: Unknowns) -> String {
    let relative = match unknowns {
        Unknowns::Three => include_str!("../wgsl/rest/relative.wgsl"),
        Unknowns::Six => include_str!("../wgsl/rest/absolute.wgsl"),
    };
    link(&[unknowns.of_rows(), SLICED, unknowns.of_columns(), relative, SMOOTH])
}

/// Returns the source of a matrix between two levels, whose rows and columns have these unknowns.
/// Its entry points are [`RESTRICT`], which overwrites a vector, and [`PROLONG`], which adds to it.
pub fn transfer(rows: Unknowns, columns: Unknowns) -> String {
    link(&[rows.of_rows(), SLICED, columns.of_columns(), TRANSFER])
}

/// Returns the source that multiplies a dense matrix by a vector.
pub fn dense() -> String {
    link(&[include_str!("../wgsl/rest/dense.wgsl")])
}

/// Returns the source of the vectors of conjugate gradients.
pub fn vectors() -> String {
    link(&[include_str!("../wgsl/rest/vectors.wgsl")])
}
