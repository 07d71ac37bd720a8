//! The errors of this crate.

/// An invalid body or option, or a search that failed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RestError {
    /// A kind has a PBD stiffness, which has no energy.
    #[error("{kind} has a PBD stiffness, which has no energy; expected compliances (XPBD)")]
    PbdStiffness {
        /// The kind.
        kind: &'static str,
    },
    /// A constraint has no finite energy where it is not met.
    #[error(
        "constraint {constraint} of {kind} has compliance {compliance}; expected a number above 0 with a finite inverse"
    )]
    Rigid {
        /// The kind.
        kind: &'static str,
        /// Number of the constraint in its kind.
        constraint: usize,
        /// Its compliance.
        compliance: f64,
    },
    /// No vertex can move.
    #[error("none of the {vertices} vertices can move; expected at least one inverse mass above 0")]
    NothingMoves {
        /// The number of vertices.
        vertices: usize,
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
    /// There is not one position per vertex.
    #[error("there are {found} positions; expected {expected}, one per vertex")]
    Length {
        /// Number of positions.
        found: usize,
        /// Number of vertices.
        expected: usize,
    },
    /// A force at the start is not finite.
    #[error("the force on vertex {vertex} is not finite; expected a finite position and energy")]
    NotFinite {
        /// The vertex.
        vertex: usize,
    },
    /// The GPU has too little memory, rejected a call or was lost.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Gpu(#[from] cutis_gpu::GpuError),
    /// The body is not at rest after the allowed steps, or no step lowers its energy.
    #[error(
        "not at rest after {steps} steps: the force is {force:e} of its scale, above {tolerance:e}; \
         the energy may have no minimum, because a part of the body is not held or a load is too large"
    )]
    NotAtRest {
        /// Number of steps.
        steps: usize,
        /// The relative force that was reached, see [`Rest::force`](crate::Rest::force).
        force: f64,
        /// The largest allowed one.
        tolerance: f64,
    },
}
