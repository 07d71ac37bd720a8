//! Graph coloring of constraints: divides index tuples into groups in which no two share a vertex.
//!
//! Two constraints that share a vertex cannot be projected at the same time. A coloring gives each
//! constraint a color so that constraints of one color share no vertex. A solver processes one
//! color after the other. It may project the constraints of a color in any order or in parallel,
//! and the result has the same bits. The coloring only sees vertex indices, never the kind of a
//! constraint.
//!
//! A solver that moves one vertex after the other needs groups of vertices instead. No two vertices
//! of a group may be in one constraint. [`greedy_vertices`] finds them from the [`Incidence`] of
//! each kind.
//!
//! ```
//! use cutis_coloring::greedy;
//!
//! // A chain of four edges over five vertices needs two colors.
//! let edges = [[0, 1], [1, 2], [2, 3], [3, 4]];
//! let groups = greedy(&edges, 5)?;
//! assert_eq!(groups.len(), 2);
//! assert_eq!(groups.group(0), [0, 2]);
//! assert_eq!(groups.group(1), [1, 3]);
//! groups.verify(&edges, 5)?;
//! # Ok::<(), cutis_coloring::ColoringError>(())
//! ```
#![forbid(unsafe_code)]

mod error;
mod greedy;
mod groups;
mod incidence;
mod sort;

mod verify;
mod vertices;

pub use error::ColoringError;
pub use greedy::greedy;
pub use groups::Groups;
pub use incidence::{Incidence, Tuples};

pub use vertices::greedy_vertices;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
