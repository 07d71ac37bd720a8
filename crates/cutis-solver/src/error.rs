//! Everything that can be wrong with a system, its settings or a run.

use crate::{Clock, Formulation, Settings};

/// Why a system was refused or a step stopped.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SolverError {
    /// A setting has a value that cannot be used.
    #[error("{key} is {value}; expected {expected}")]
    Setting {
        /// Name of the setting.
        key: &'static str,
        /// What it was.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// An array given for the vertices has the wrong length.
    #[error("{what} has {found} entries; expected {expected}, one per vertex")]
    VertexLength {
        /// Which array.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The number of vertices.
        expected: usize,
    },
    /// More vertices or constraints than a 32-bit index can name.
    #[error("{count} {what} are too many; at most {} can be numbered", u32::MAX)]
    TooMany {
        /// What is counted.
        what: &'static str,
        /// How many there are.
        count: usize,
    },
    /// A vertex has a value that cannot be used.
    #[error("vertex {vertex}: {what} is {value}; expected {expected}")]
    Vertex {
        /// Which vertex.
        vertex: usize,
        /// Which value of it.
        what: &'static str,
        /// What it was.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// An array given for a kind of constraint has the wrong length.
    #[error("{kind}: {found} {what}; expected {expected}, one per constraint")]
    KindLength {
        /// Which kind.
        kind: &'static str,
        /// Which array.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The number of constraints.
        expected: usize,
    },
    /// A constraint names a vertex that does not exist.
    #[error("{kind} constraint {constraint} names vertex {vertex}, but there are {vertex_count} vertices")]
    VertexOutOfRange {
        /// Which kind.
        kind: &'static str,
        /// Which constraint.
        constraint: usize,
        /// The vertex it names.
        vertex: u32,
        /// The number of vertices.
        vertex_count: usize,
    },
    /// A constraint names a vertex twice.
    #[error("{kind} constraint {constraint} names vertex {vertex} twice; its vertices must differ")]
    RepeatedVertex {
        /// Which kind.
        kind: &'static str,
        /// Which constraint.
        constraint: usize,
        /// The vertex it names twice.
        vertex: u32,
    },
    /// A parameter (rest length, rest volume, …) is not finite.
    #[error("{kind} constraint {constraint}: parameter {parameter} is {value}; expected a finite number")]
    Parameter {
        /// Which kind.
        kind: &'static str,
        /// Which constraint.
        constraint: usize,
        /// Which of its parameters, counted from 0.
        parameter: usize,
        /// What it was.
        value: f64,
    },
    /// The rest shape of a constraint has no size: a mesh with two vertices at one place, a flat triangle or tetrahedron.
    #[error(
        "{kind} constraint {constraint} of the vertices {vertices:?} has a rest shape of size 0; \
             its vertices must span an element"
    )]
    RestShape {
        /// Which kind.
        kind: &'static str,
        /// Which constraint.
        constraint: usize,
        /// Its vertices.
        vertices: Vec<u32>,
    },
    /// A constraint is violated and cannot act: its gradient is zero, as where its vertices have collapsed to a point or a
    /// line. No step will change that by itself.
    #[error(
        "{kind} of the vertices {vertices:?} is off by {ratio} of its rest size and has no gradient there: \
             its vertices have collapsed, and nothing says in which direction they should part"
    )]
    Collapsed {
        /// Which kind.
        kind: &'static str,
        /// The vertices of the constraint.
        vertices: Vec<u32>,
        /// Its value over its rest size.
        ratio: f64,
    },
    /// A stiffness or a compliance is out of range.
    #[error("{kind}{}: stiffness is {value}; expected {expected}", constraint.map(|k| format!(" constraint {k}")).unwrap_or_default())]
    Stiffness {
        /// Which kind.
        kind: &'static str,
        /// Which constraint; `None` when one value serves all of them.
        constraint: Option<usize>,
        /// What it was.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// The groups do not fit the constraints.
    #[error("{kind}: the groups do not fit the constraints: {reason}")]
    Groups {
        /// Which kind.
        kind: &'static str,
        /// What the coloring found.
        reason: String,
    },
    /// A kind was given the stiffness of another formulation than the settings ask for.
    #[error("{kind} has a stiffness for {found:?}, but the settings ask for {expected:?}")]
    Formulation {
        /// Which kind.
        kind: &'static str,
        /// What its stiffness is for.
        found: Formulation,
        /// What the settings say.
        expected: Formulation,
    },
    /// A handle moves a vertex that does not exist, or that another handle moves already.
    #[error("handle {handle}: vertex {vertex} {reason}")]
    Handle {
        /// Which handle, in the order they were added.
        handle: usize,
        /// Which vertex.
        vertex: u32,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// A position became infinite or NaN during a step. The positions were set back to those at `time_s`, the start of
    /// that substep, and the velocities to zero.
    #[error(
        "vertex {vertex} left the finite numbers in frame {frame}, substep {substep}; \
         the state is that of {time_s} s, at rest: try more substeps, more damping or a softer material"
    )]
    NotFinite {
        /// The first such vertex.
        vertex: usize,
        /// Frame, counted from 0 at the start of the solver.
        frame: u64,
        /// Substep of that frame, counted from 0.
        substep: u32,
        /// Time of the state that was kept, in seconds.
        time_s: f64,
    },
    /// The device of a backend failed. What the host last read of the body is kept, and is that of `time_s`.
    #[error("the {backend} backend stopped: {reason}; the last state that was read is that of {time_s} s")]
    Device {
        /// Which backend.
        backend: &'static str,
        /// What happened.
        reason: String,
        /// Time of the state that was kept, in seconds.
        time_s: f64,
    },
}

impl SolverError {
    /// [`NotFinite`](Self::NotFinite) for a body whose state is that of `clock`.
    pub fn not_finite(vertex: usize, clock: Clock, settings: &Settings) -> Self {
        let Clock { frame, substep } = clock;
        Self::NotFinite { vertex, frame, substep, time_s: clock.time_s(settings) }
    }
}
