//! Cuts of no width: severed edges, and the copies of tets along them.
//!
//! A [`Blade`] severs the lattice edges that it crosses. [`Severing`] holds the severed edges,
//! which only grow. [`Severing::wound`] derives all else from them: a tet whose corners fall apart
//! into parts is replaced by one copy for each part, with virtual nodes in place of the corners of
//! the other parts (Molino, Bao and Fedkiw 2004, doi:10.1145/1015706.1015734). Tissue is never
//! removed, and a body that is cut but not moved is the body before the cut.

mod axis_edges;
mod blade;
mod bowl;
mod components;
mod depth;
mod divide;
mod edge_copies;
mod growth;
mod incise;
mod lip_pairs;
mod lips;
mod nodes;
mod pieces;
mod pocket;
mod ribbon;
mod section;
mod severing;
mod shell;
mod shell_nodes;
mod stations;
mod surface;
mod tet_index;
mod walls;
mod wound;

pub use axis_edges::AxisEdge;
pub use blade::{Blade, Station};
pub(crate) use bowl::Bowl;
pub use growth::{Growth, Stage, VirtualNode};
pub use incise::Severed;
pub use lip_pairs::LipPair;
pub use lips::LipPoint;
pub(crate) use nodes::Classes;
pub use pieces::{Embedded, Pieces};
pub(crate) use pocket::PocketFloor;
pub use severing::Severing;
pub(crate) use severing::longest_edge;
pub(crate) use shell::{DividedShell, divide_shell};
pub(crate) use stations::stations;
pub(crate) use surface::closest_in_triangle;
pub use walls::{Barycentric, Walls};
pub use wound::{EdgeCopy, SplitTet, TetCopy, TooManyBlades, TriangleCopy, Wound};
