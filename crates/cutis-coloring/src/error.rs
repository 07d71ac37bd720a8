//! The errors of this crate.

/// Invalid constraints, colors or groups, or a lack of memory.
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
        /// The vertex.
        vertex: u32,
        /// Number of vertices.
        vertex_count: usize,
    },
    /// A constraint names the same vertex twice.
    #[error("constraint {constraint} names vertex {vertex} twice; its vertices must be distinct")]
    RepeatedVertex {
        /// Index of the constraint.
        constraint: usize,
        /// The repeated vertex.
        vertex: u32,
    },
    /// There are more constraints than 32-bit indices can address.
    #[error("{count} constraints; at most {limit} can be numbered in 32 bits")]
    TooManyConstraints {
        /// Number of constraints.
        count: usize,
        /// The largest allowed number.
        limit: usize,
    },
    /// There are more vertices than 32-bit indices can address.
    #[error("{count} vertices; at most {limit} can be numbered in 32 bits")]
    TooManyVertices {
        /// Number of vertices.
        count: usize,
        /// The largest allowed number.
        limit: usize,
    },
    /// The working arrays could not be allocated.
    #[error("cannot allocate {bytes} bytes for the working arrays")]
    OutOfMemory {
        /// Size of the array that could not be allocated.
        bytes: usize,
    },
    /// The offsets do not divide `order` into consecutive groups.
    #[error(
        "offset {position} of the groups is wrong; offsets must start at 0, never decrease, and end at \
         {order_len}, the length of the order"
    )]
    BrokenOffsets {
        /// Position of the first wrong offset.
        position: usize,
        /// Length of the order.
        order_len: usize,
    },
    /// The order does not name each constraint exactly once.
    #[error(
        "entry {position} of the order names constraint {constraint}, which is out of range or already \
         named; the order must name each of the {count} constraints exactly once"
    )]
    NotAPermutation {
        /// Position in the order.
        position: usize,
        /// The constraint at this position.
        constraint: u32,
        /// Number of constraints.
        count: usize,
    },
    /// The number of entries in the order differs from the number of constraints.
    #[error("the order has {order_len} entries; expected one for each of {count} constraints")]
    WrongLength {
        /// Length of the order.
        order_len: usize,
        /// Number of constraints.
        count: usize,
    },
    /// Two constraints of one group share a vertex.
    #[error("constraints {first} and {second} of group {group} share vertex {vertex}")]
    Clash {
        /// The group (color).
        group: usize,
        /// The constraint that comes first in the group.
        first: u32,
        /// The constraint that comes later in the group.
        second: u32,
        /// The shared vertex.
        vertex: u32,
    },
    /// Groups of vertices must name each moving vertex exactly once, and no fixed vertex.
    #[error(
        "vertex {vertex} is missing, repeated or fixed; groups of vertices must name each moving vertex \
         exactly once and no other vertex"
    )]
    WrongVertex {
        /// The vertex.
        vertex: u32,
    },
    /// Two vertices of one group are in the same constraint.
    #[error("vertices {first} and {second} of group {group} are both in constraint {constraint}")]
    VertexClash {
        /// The group (color).
        group: usize,
        /// A vertex of the constraint.
        first: u32,
        /// A later vertex of the constraint.
        second: u32,
        /// Index of the constraint within its kind.
        constraint: usize,
    },
}
