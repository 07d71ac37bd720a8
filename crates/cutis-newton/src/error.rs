//! The errors of this crate.

/// An invalid problem or option, or a minimization that failed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NewtonError {
    /// A kind has a PBD stiffness, which has no energy.
    #[error("{kind} has a PBD stiffness, which has no energy; expected compliances (XPBD)")]
    PbdStiffness {
        /// The kind.
        kind: &'static str,
    },
    /// A constraint has the compliance 0, or one so small that its energy is infinite wherever it
    /// is not met.
    #[error(
        "{kind} of the vertices {vertices:?} has compliance {compliance}, whose energy ½C²/α is not finite; \
         expected a compliance above 0 with a finite inverse"
    )]
    Rigid {
        /// The kind.
        kind: &'static str,
        /// The vertices of the constraint.
        vertices: Vec<u32>,
        /// The compliance.
        compliance: f64,
    },
    /// No vertex has a finite mass.
    #[error("none of the {vertices} vertices can move; expected at least one inverse mass above 0")]
    NothingMoves {
        /// The number of vertices.
        vertices: usize,
    },
    /// A per-vertex array has the wrong length.
    #[error("{what} has {found} entries; expected {expected}, one per vertex")]
    Length {
        /// The name of the array.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The number of vertices.
        expected: usize,
    },
    /// An argument is out of range.
    #[error("{what} is {value}; expected {expected}")]
    Value {
        /// The name of the argument.
        what: &'static str,
        /// The value.
        value: f64,
        /// The valid range.
        expected: &'static str,
    },
    /// A vertex has a coordinate or, at the start of a minimization, a force that is not finite.
    #[error("vertex {vertex}: {what} is not finite")]
    NotFinite {
        /// The vertex.
        vertex: usize,
        /// The name of the quantity.
        what: &'static str,
    },
    /// Nothing holds a connected part of the body. It can move as a whole, so it has no equilibrium
    /// or infinitely many.
    #[error(
        "nothing holds the part of {vertices} vertices with vertex {vertex}, so it can move as a whole; \
         fix a vertex of each part (inverse mass 0)"
    )]
    Floating {
        /// The first vertex of that part.
        vertex: usize,
        /// Number of its vertices.
        vertices: usize,
    },
    /// The factors of the Hessian do not fit into memory or cannot be indexed.
    #[error(
        "cannot allocate {} bytes for the factors of the Hessian of {free} free vertices",
        bytes.map_or("more than 2^64".into(), |b: u64| b.to_string())
    )]
    Memory {
        /// Number of free vertices.
        free: usize,
        /// Required bytes, if they can be counted.
        bytes: Option<u64>,
    },
    /// The gradient is still too large after the allowed iterations, or no step along a descent
    /// direction lowers the energy.
    #[error(
        "not converged after {iterations} iterations: the gradient is {gradient:e} of its scale, above the tolerance \
         {tolerance:e}; try more iterations, a better start or a looser tolerance"
    )]
    NotConverged {
        /// Number of iterations.
        iterations: usize,
        /// The relative gradient that was reached, see
        /// [`Options::tolerance`](crate::Options::tolerance).
        gradient: f64,
        /// The requested tolerance.
        tolerance: f64,
    },
}
