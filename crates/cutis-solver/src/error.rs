//! Errors of systems, settings and runs.

use crate::{Clock, Formulation, Settings};

/// An error in the input of a solver or during a step.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SolverError {
    /// A setting is out of range.
    #[error("{key} is {}; expected {expected}", short(*value))]
    Setting {
        /// Name of the setting.
        key: &'static str,
        /// The value.
        value: f64,
        /// The values that are allowed.
        expected: &'static str,
    },
    /// An array given for the vertices has the wrong length.
    #[error("{what} has {found} entries; expected {expected}, one per vertex")]
    VertexLength {
        /// Name of the array.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The number of vertices.
        expected: usize,
    },
    /// There are more vertices or constraints than a 32-bit index can address.
    #[error("{count} {what} are too many; expected at most {}", u32::MAX)]
    TooMany {
        /// `vertices` or `constraints`.
        what: &'static str,
        /// Their number.
        count: usize,
    },
    /// A value of a vertex is out of range.
    #[error("vertex {vertex}: {what} is {value}; expected {expected}")]
    Vertex {
        /// Index of the vertex.
        vertex: usize,
        /// Name of the value.
        what: &'static str,
        /// The value.
        value: f64,
        /// The values that are allowed.
        expected: &'static str,
    },
    /// An array given for a kind of constraint has the wrong length.
    #[error("{kind}: {found} {what}; expected {expected}, one per constraint")]
    KindLength {
        /// Name of the kind.
        kind: &'static str,
        /// Name of the array.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The number of constraints.
        expected: usize,
    },
    /// A constraint refers to a vertex that does not exist.
    #[error(
        "{kind} constraint {constraint} refers to vertex {vertex}, but there are {vertex_count} vertices"
    )]
    VertexOutOfRange {
        /// Name of the kind.
        kind: &'static str,
        /// Index of the constraint.
        constraint: usize,
        /// Index of the vertex.
        vertex: u32,
        /// The number of vertices.
        vertex_count: usize,
    },
    /// A constraint refers to a vertex twice.
    #[error("{kind} constraint {constraint} refers to vertex {vertex} twice; expected different vertices")]
    RepeatedVertex {
        /// Name of the kind.
        kind: &'static str,
        /// Index of the constraint.
        constraint: usize,
        /// Index of the vertex.
        vertex: u32,
    },
    /// A parameter (rest length, rest volume, …) is not finite.
    #[error("{kind} constraint {constraint}: parameter {parameter} is {value}; expected a finite number")]
    Parameter {
        /// Name of the kind.
        kind: &'static str,
        /// Index of the constraint.
        constraint: usize,
        /// Index of the parameter.
        parameter: usize,
        /// The value.
        value: f64,
    },
    /// The rest shape of a constraint has size zero: two vertices coincide, or a triangle or
    /// tetrahedron is flat.
    #[error(
        "{kind} constraint {constraint} with the vertices {vertices:?} has a rest shape of size 0; \
             expected an edge of positive length or an element that is not flat"
    )]
    RestShape {
        /// Name of the kind.
        kind: &'static str,
        /// Index of the constraint.
        constraint: usize,
        /// Indices of the vertices.
        vertices: Vec<u32>,
    },
    /// A violated constraint cannot act, because its gradient is zero. This happens if its vertices
    /// have collapsed to a point or a line. More steps do not resolve it.
    #[error(
        "the {kind} constraint with the vertices {vertices:?} is violated by {ratio} of its rest size \
             but has no gradient: its vertices have collapsed, and no direction separates them"
    )]
    Collapsed {
        /// Name of the kind.
        kind: &'static str,
        /// Indices of the vertices of the constraint.
        vertices: Vec<u32>,
        /// The constraint's value divided by its rest size.
        ratio: f64,
    },
    /// A stiffness or a compliance is out of range.
    #[error("{kind}{}: stiffness is {value}; expected {expected}", constraint.map(|k| format!(" constraint {k}")).unwrap_or_default())]
    Stiffness {
        /// Name of the kind.
        kind: &'static str,
        /// Index of the constraint, or `None` for a value of all constraints.
        constraint: Option<usize>,
        /// The value.
        value: f64,
        /// The values that are allowed.
        expected: &'static str,
    },
    /// The color groups do not fit the constraints.
    #[error("{kind}: the groups do not fit the constraints: {reason}")]
    Groups {
        /// Name of the kind.
        kind: &'static str,
        /// The error of the coloring.
        reason: String,
    },
    /// The stiffness of a kind is for another formulation than that of the settings.
    #[error("{kind} has a stiffness for {found:?}, but the settings select {expected:?}")]
    Formulation {
        /// Name of the kind.
        kind: &'static str,
        /// The formulation of the stiffness.
        found: Formulation,
        /// The formulation of the settings.
        expected: Formulation,
    },
    /// A vertex of a handle does not exist or belongs to another handle.
    #[error("handle {handle}: vertex {vertex} {reason}")]
    Handle {
        /// Index of the handle, in the order in which handles were added.
        handle: usize,
        /// Index of the vertex.
        vertex: u32,
        /// Description of the problem.
        reason: &'static str,
    },
    /// A position became infinite or NaN during a step. The positions were reset to those at
    /// `time_s`, the start of that substep, and the velocities to zero.
    #[error(
        "the position of vertex {vertex} is not finite after frame {frame}, substep {substep}; \
             the state was reset to {time_s} s, at rest: try more substeps, more damping or a softer material"
    )]
    NotFinite {
        /// The first such vertex.
        vertex: usize,
        /// Index of the frame, counted from the start of the simulation.
        frame: u64,
        /// Index of the substep within the frame.
        substep: u32,
        /// Time of the present state, in seconds.
        time_s: f64,
    },
    /// Frames of a [`Resting`](crate::Resting) body.
    #[error("this body only rests: it was not prepared for frames")]
    Resting,
    /// The device of a backend failed. The host keeps the last state that it read, at `time_s`.
    #[error("the {backend} backend stopped: {reason}; the last known state is that at {time_s} s")]
    Device {
        /// Name of the backend.
        backend: &'static str,
        /// The error of the device.
        reason: String,
        /// Time of the present state, in seconds.
        time_s: f64,
    },
}

/// A number as text: a large one with an exponent, in place of hundreds of digits.
fn short(value: f64) -> String {
    if value.abs() < 1e16 { value.to_string() } else { format!("{value:e}") }
}

impl SolverError {
    /// Returns [`NotFinite`](Self::NotFinite) for a state that was reset to the time of `clock`.
    pub fn not_finite(vertex: usize, clock: Clock, settings: &Settings) -> Self {
        let Clock { frame, substep } = clock;
        Self::NotFinite { vertex, frame, substep, time_s: clock.time_s(settings) }
    }
}
