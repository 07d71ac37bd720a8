//! Wound gape: the distance between the two lips of a slit.

use std::ops::Range;

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::sever::{Embedded, LipPoint};
use crate::slit::{Slit, SlitPoint};
use crate::{MeshError, TetMesh};

/// Largest number of bins along one slit.
const MOST_BINS: f64 = 1024.0;

/// The points and the axis by which the opening of a wound is measured.
///
/// The left lip is on the left side of the middle surface of the slit, the right lip on the other
/// side. Only points between the start and the end of the path count. The lips of a cut that
/// removes tissue are the remaining skin vertices of the skin triangles that the slit opens. The
/// lips of a cut of no width are the points where it cuts the edges of the skin.
///
/// The path is divided into equal bins of at least one lattice step. The opening in a bin is the
/// difference between the mean positions of the two lips, along the lateral axis of the slit at
/// rest. The opening is also measured in the middle tenth of the path, or in one lattice step if
/// that is longer.
///
/// The points are chosen at rest, so that openings before and after a run differ only by motion. At
/// rest the opening of a cut of no width is 0. Otherwise it is at least the distance between the
/// nearest remaining vertices, that is, the width rounded up to the lattice.
#[derive(Clone, Debug)]
pub struct Gape {
    /// The bins in the middle 80 % of the path that have points on both sides.
    bins: Vec<Sides>,
    middle: Sides,
    /// Points of the left lip, then of the right lip.
    points: Vec<Embedded>,
    left: usize,
}

/// A point of a lip at rest.
struct Placed {
    point: Embedded,
    right: bool,
    /// Length along the path in m.
    along: f64,
}

/// The points of both lips in a part of the path, as ranges of `Gape::points`.
#[derive(Clone, Debug)]
struct Sides {
    /// Unit vector from the left to the right lip at rest.
    lateral: Vector3<f64>,
    left: Range<usize>,
    right: Range<usize>,
}

/// Openings of one wound in mm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WoundGape {
    /// Mean opening over the bins, without the first and last tenth of the path.
    pub mean_mm: f64,
    /// Opening in the middle tenth.
    pub mid_mm: f64,
    /// As `mean_mm`, but with the distance between the mean positions instead of its lateral
    /// component.
    pub mean_distance_mm: f64,
    /// As `mid_mm`, but with the distance between the mean positions.
    pub mid_distance_mm: f64,
    /// Number of measured bins.
    pub bins: usize,
}

impl Gape {
    /// The gape of a cut that removes tissue. `lips` are the remaining vertices at its lips.
    pub(crate) fn of_vertices(
        mesh: &TetMesh,
        slits: &[Slit],
        lips: &[u32],
        step: f64,
    ) -> Result<Self, MeshError> {
        let place = |&vertex: &u32| {
            let (along, at) = place(slits, mesh.positions[vertex as usize].cast())?;
            Some(Placed { point: Embedded::node(vertex), right: at.lateral >= 0.0, along })
        };
        Self::new(slits, lips.iter().filter_map(place).collect(), step)
    }

    /// The gape of a cut of no width. `rest` are the positions of all nodes.
    pub(crate) fn of_lips(
        rest: &[Point3<f32>],
        slits: &[Slit],
        lips: &[LipPoint],
        step: f64,
    ) -> Result<Self, MeshError> {
        let place = |lip: &LipPoint| {
            let (along, _) = place(slits, lip.at.at(rest).cast())?;
            Some(Placed { point: lip.at, right: lip.right, along })
        };
        Self::new(slits, lips.iter().filter_map(place).collect(), step)
    }

    /// The gape of a wound from which a piece was excised, across the line between the two points
    /// of its outline that are farthest apart. `rest` are the positions of all nodes. Before the
    /// wound is closed it is open by the width of the piece.
    pub(crate) fn of_outline(
        rest: &[Point3<f32>],
        axis: &Slit,
        lips: &[LipPoint],
        step: f64,
    ) -> Result<Self, MeshError> {
        let axis = std::slice::from_ref(axis);
        let place = |lip: &LipPoint| {
            let (along, at) = place(axis, lip.at.at(rest).cast())?;
            Some(Placed { point: lip.at, right: at.lateral >= 0.0, along })
        };
        Self::new(axis, lips.iter().filter(|lip| lip.right).filter_map(place).collect(), step)
    }

    fn new(slits: &[Slit], mut placed: Vec<Placed>, step: f64) -> Result<Self, MeshError> {
        let length: f64 = slits.iter().map(|slit| slit.length).sum();
        // The sort is stable, so that points at one place keep their order.
        placed.sort_by(|a, b| a.right.cmp(&b.right).then(a.along.total_cmp(&b.along)));
        let left = placed.partition_point(|placed| !placed.right);
        let right = placed.len() - left;
        if left == 0 || right == 0 {
            return Err(MeshError::IncisionWithoutLips { incision: slits[0].incision, left, right });
        }
        let between = |from: f64, to: f64| {
            let find = |part: Range<usize>, limit: f64| {
                part.start + placed[part].partition_point(|placed| placed.along < limit)
            };
            Sides {
                lateral: lateral_at(slits, 0.5 * (from + to)),
                left: find(0..left, from)..find(0..left, to),
                right: find(left..placed.len(), from)..find(left..placed.len(), to),
            }
        };
        let count = (length / step).floor().clamp(1.0, MOST_BINS);
        let width = length / count;
        let inner = |bin: &f64| count < 10.0 / 8.0 || (0.1..=0.9).contains(&((bin + 0.5) / count));
        let bins = (0..count as usize).map(|bin| bin as f64).filter(inner);
        let bins: Vec<Sides> =
            bins.map(|bin| between(bin * width, (bin + 1.0) * width)).filter(Sides::complete).collect();
        // Widen the middle until it contains a point of each lip. The whole path does.
        let mut half = (length / 20.0).max(step / 2.0);
        let mut middle = between(length / 2.0 - half, length / 2.0 + half);
        while !middle.complete() {
            half *= 2.0;
            middle = between(length / 2.0 - half, length / 2.0 + half);
        }
        let bins = if bins.is_empty() { vec![middle.clone()] } else { bins };
        let points = placed.iter().map(|placed| placed.point).collect();
        Ok(Self { bins, middle, points, left })
    }

    /// Points of the left lip, from start to end.
    pub fn left(&self) -> &[Embedded] {
        &self.points[..self.left]
    }

    /// Points of the right lip, from start to end.
    pub fn right(&self) -> &[Embedded] {
        &self.points[self.left..]
    }

    /// The vertices whose positions the opening depends on, in ascending order.
    pub fn vertices(&self) -> Vec<u32> {
        let used = self.points.iter().flat_map(|point| {
            point.nodes.into_iter().zip(point.weights).filter(|(_, weight)| *weight != 0.0)
        });
        let mut vertices: Vec<u32> = used.map(|(node, _)| node).collect();
        vertices.sort_unstable();
        vertices.dedup();
        vertices
    }

    /// Measures the openings at the given positions: local meters, one per mesh vertex.
    ///
    /// # Panics
    /// If there are fewer positions than mesh vertices.
    pub fn measure(&self, positions: &[Point3<f32>]) -> WoundGape {
        self.measure_by(&|vertex| positions[vertex as usize].cast())
    }

    /// Measures the openings. `position` returns the position of a mesh vertex in local meters.
    pub fn measure_by(&self, position: &dyn Fn(u32) -> Point3<f64>) -> WoundGape {
        let mean = |part: &Range<usize>| {
            let at = |point: &Embedded| point.at_by(position).coords;
            self.points[part.clone()].iter().fold(Vector3::zeros(), |sum, point| sum + at(point))
                / part.len() as f64
        };
        let opening = |sides: &Sides| {
            let apart = (mean(&sides.right) - mean(&sides.left)) * 1000.0;
            (apart.dot(&sides.lateral), apart.norm())
        };
        let bins = self.bins.len();
        let (lateral, distance) =
            self.bins.iter().map(opening).fold((0.0, 0.0), |sum, (l, d)| (sum.0 + l, sum.1 + d));
        let (mid_mm, mid_distance_mm) = opening(&self.middle);
        WoundGape {
            mean_mm: lateral / bins as f64,
            mid_mm,
            mean_distance_mm: distance / bins as f64,
            mid_distance_mm,
            bins,
        }
    }
}

/// Length along the path of some slits at a position, and its coordinates in the slit that is
/// closest to it. None if it lies next to no slit.
fn place(slits: &[Slit], position: Point3<f64>) -> Option<(f64, SlitPoint)> {
    let mut before = 0.0;
    let mut best: Option<(f64, SlitPoint)> = None;
    for slit in slits {
        let at = slit.coordinates(position);
        let closer = best.is_none_or(|(_, other)| at.lateral.abs() < other.lateral.abs());
        if (0.0..=slit.length).contains(&at.along) && closer {
            best = Some((before + at.along, at));
        }
        before += slit.length;
    }
    best
}

/// Lateral axis of the slit at a length along the path.
fn lateral_at(slits: &[Slit], along: f64) -> Vector3<f64> {
    let mut end = 0.0;
    let holds = |slit: &&Slit| {
        end += slit.length;
        along < end
    };
    slits.iter().find(holds).unwrap_or(&slits[slits.len() - 1]).lateral
}

impl Sides {
    fn complete(&self) -> bool {
        !self.left.is_empty() && !self.right.is_empty()
    }
}
