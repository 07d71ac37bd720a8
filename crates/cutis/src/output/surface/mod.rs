//! The surface of a body that `report.html` shows: the skin and the walls of wounds. It has a
//! bounded number of points, and some states of a run are kept for it.

mod build;
mod encode;
mod ends;
mod places;
mod recorder;
mod reduce;
mod unmatched;
mod walls;

use cutis_mesh::sever::Embedded;
use nalgebra::{Point3, Vector3};

pub(crate) use encode::{Encoded, encode};
pub(crate) use recorder::{Recorder, State};

/// Largest number of points of a surface that is shown. They have 16-bit numbers.
pub(crate) const MOST_POINTS: usize = 40_000;

/// Largest number of bytes of a surface with its states, before base64.
pub(crate) const MOST_BYTES: usize = 4_500_000;

/// Largest number of states that are kept, without the one in the scan.
const MOST_STATES: usize = 40;

/// A surface that moves with nodes of the body.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Surface {
    /// Positions in the scan, local meters. Those that can move come first.
    pub(crate) rest: Vec<Point3<f32>>,
    /// The first points, as sums of nodes. Their nodes are numbers in `nodes`.
    pub(crate) moving: Vec<Embedded>,
    /// Mesh vertices that the points follow, ascending.
    pub(crate) nodes: Vec<u32>,
    /// Triangles in points, with the outside on the left of their corners' order.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Color of the tissue at each point, and whether it is on the skin and not in a wound.
    pub(crate) tissue: Vec<([u8; 3], bool)>,
}

impl Surface {
    /// Displacement of each moving point in mm. `positions` are those of `nodes`, local meters.
    fn moved_mm(&self, positions: &[Point3<f32>]) -> Vec<Vector3<f32>> {
        let moved = |(point, rest): (&Embedded, &Point3<f32>)| (point.at(positions) - rest) * 1000.0;
        self.moving.iter().zip(&self.rest).map(moved).collect()
    }

    /// Bytes of the encoded surface without states.
    fn bytes(&self) -> usize {
        6 * self.triangles.len() + 10 * self.rest.len()
    }

    /// Bytes of one encoded state.
    fn state_bytes(&self) -> usize {
        6 * self.moving.len()
    }
}
