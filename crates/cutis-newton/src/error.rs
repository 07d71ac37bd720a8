//! Everything that can be wrong with a problem, its options or a minimization.

/// Why a system has no minimum that could be found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NewtonError {
    /// A kind has a PBD stiffness, which stands for no energy.
    #[error("{kind} has a PBD stiffness, which stands for no energy; expected compliances (XPBD)")]
    PbdStiffness {
        /// Which kind.
        kind: &'static str,
    },
    /// A constraint has the compliance 0: its energy is infinite wherever it is not met.
    #[error(
        "{kind} of the vertices {vertices:?} has compliance {compliance}, whose energy ½C²/α is not finite; \
         expected a compliance above 0 with a finite inverse"
    )]
    Rigid {
        /// Which kind.
        kind: &'static str,
        /// The vertices of the constraint.
        vertices: Vec<u32>,
        /// Its compliance.
        compliance: f64,
    },
    /// No vertex has a finite mass.
    #[error("none of {vertices} vertices can move; expected at least one with an inverse mass above 0")]
    NothingMoves {
        /// The number of vertices.
        vertices: usize,
    },
    /// An array given for the vertices has the wrong length.
    #[error("{what} has {found} entries; expected {expected}, one per vertex")]
    Length {
        /// Which array.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The number of vertices.
        expected: usize,
    },
    /// A number that was given cannot be used.
    #[error("{what} is {value}; expected {expected}")]
    Value {
        /// What it is.
        what: &'static str,
        /// The number.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// A vertex has a coordinate or, where the minimization starts, a force that is not finite.
    #[error("vertex {vertex}: {what} is not finite")]
    NotFinite {
        /// Which vertex.
        vertex: usize,
        /// What of it.
        what: &'static str,
    },
    /// A part of the body hangs together, but nothing holds it: it can move as a whole, and has no equilibrium or endlessly
    /// many.
    #[error(
        "vertex {vertex} belongs to a part of {vertices} vertices that nothing holds: it can move as a whole; \
         hold a vertex of each part (inverse mass 0)"
    )]
    Floating {
        /// The first vertex of that part.
        vertex: usize,
        /// How many vertices it has.
        vertices: usize,
    },
    /// The factors of the Hessian do not fit into memory, or cannot be numbered.
    #[error("the factors of the Hessian of {free} vertices need {} bytes, which cannot be had", bytes.map_or("more than 2^64".into(), |b: u64| b.to_string()))]
    Memory {
        /// Vertices that can move.
        free: usize,
        /// Bytes needed, where they can be counted.
        bytes: Option<u64>,
    },
    /// The gradient is still too large after as many iterations as were allowed, or no step along a descent direction lowers
    /// the energy any more.
    #[error(
        "not converged after {iterations} iterations: the gradient is {gradient:e} of its scale, above the tolerance \
         {tolerance:e}; try more iterations, a better start or a looser tolerance"
    )]
    NotConverged {
        /// Iterations done.
        iterations: usize,
        /// Relative gradient reached, see [`Options::tolerance`](crate::Options::tolerance).
        gradient: f64,
        /// What was asked for.
        tolerance: f64,
    },
}
