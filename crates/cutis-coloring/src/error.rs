//! What can be wrong with constraints, colors or groups.

/// Why constraints could not be grouped, or why groups are not a valid coloring of them.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ColoringError {
    /// A constraint names a vertex that does not exist.
    #[error(
        "constraint {constraint} names vertex {vertex}, but there are {vertex_count} vertices (0 to {vertex_count} - 1)"
    )]
    VertexOutOfRange {
        /// Index of the constraint.
        constraint: usize,
        /// The vertex that it names.
        vertex: u32,
        /// Number of vertices.
        vertex_count: usize,
    },
    /// A constraint names the same vertex twice.
    #[error("constraint {constraint} names vertex {vertex} twice; its vertices must be distinct")]
    RepeatedVertex {
        /// Index of the constraint.
        constraint: usize,
        /// The vertex that is named twice.
        vertex: u32,
    },
    /// More constraints than a `u32` can number.
    #[error("{count} constraints; at most {limit} can be numbered in 32 bits")]
    TooManyConstraints {
        /// Number of constraints.
        count: usize,
        /// The most that are allowed.
        limit: usize,
    },
    /// More vertices than a `u32` can number.
    #[error("{count} vertices; at most {limit} can be numbered in 32 bits")]
    TooManyVertices {
        /// Number of vertices.
        count: usize,
        /// The most that are allowed.
        limit: usize,
    },
    /// The memory for the working arrays could not be had.
    #[error("no memory for {bytes} bytes of working arrays")]
    OutOfMemory {
        /// Size of the array that was refused.
        bytes: usize,
    },
    /// The offsets do not cut `order` into consecutive groups.
    #[error(
        "group offsets must start at 0, never fall, and end at {order_len}, the length of the order; \
         offset {position} is wrong"
    )]
    BrokenOffsets {
        /// Position of the first wrong offset.
        position: usize,
        /// Length of the order.
        order_len: usize,
    },
    /// The order does not name each constraint exactly once.
    #[error(
        "the order must name each of the {count} constraints exactly once; entry {position} names constraint {constraint}, \
         which is out of range or named before"
    )]
    NotAPermutation {
        /// Position in the order.
        position: usize,
        /// The constraint named there.
        constraint: u32,
        /// Number of constraints.
        count: usize,
    },
    /// The order holds more or fewer entries than there are constraints.
    #[error("the order holds {order_len} entries for {count} constraints")]
    WrongLength {
        /// Length of the order.
        order_len: usize,
        /// Number of constraints.
        count: usize,
    },
    /// Two constraints of one group share a vertex.
    #[error("constraints {first} and {second}, both of group {group}, share vertex {vertex}")]
    Clash {
        /// The group (color).
        group: usize,
        /// The constraint that comes first in the group.
        first: u32,
        /// The constraint that comes later in the group.
        second: u32,
        /// The vertex that they share.
        vertex: u32,
    },
    /// Groups of vertices do not name each vertex that moves exactly once, and no other.
    #[error(
        "groups of vertices must name each vertex that moves once, and no other; vertex {vertex} is named wrongly or not at all"
    )]
    WrongVertex {
        /// The vertex.
        vertex: u32,
    },
    /// Two vertices of one group are in one constraint.
    #[error("vertices {first} and {second}, both of group {group}, are in constraint {constraint}")]
    VertexClash {
        /// The group (color).
        group: usize,
        /// A vertex of the constraint.
        first: u32,
        /// A later vertex of the constraint.
        second: u32,
        /// The constraint, counted within its kind.
        constraint: usize,
    },
}
