//! Lattice points that lie off the planes of their lattice.

use cutis_volume::Grid;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::{Lattice, MeshError};

/// Part of its volume that each tet keeps when points are moved.
const LEAST_VOLUME: f64 = 0.2;

/// Factor by which the moves at a tet with too little volume become shorter in each round.
const SHORTER: f64 = 0.85;

/// Rounds after which the moves at such tets become zero.
const ROUNDS: usize = 40;

/// The points that lie off their planes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Moves {
    /// Flat indices, ascending.
    points: Vec<u32>,
    /// Displacement of each of these points in world mm.
    mm: Vec<Vector3<f64>>,
    /// Length of the longest edge at these points in mm.
    longest_edge_mm: f64,
}

impl Moves {
    /// Displacement of a point in mm. It is zero for most points.
    pub(crate) fn of(&self, point: usize) -> Vector3<f64> {
        let found = self.points.binary_search_by(|&other| (other as usize).cmp(&point));
        found.map_or_else(|_| Vector3::zeros(), |n| self.mm[n])
    }
}

impl Lattice {
    /// Moves points off the planes of the lattice, for example onto a smooth skin.
    ///
    /// `points` are flat indices in ascending order, and `mm` are their displacements in world mm.
    /// Cells, tets, neighbors and colors stay those of the lattice. [`Lattice::mm`] returns the new
    /// places. [`Lattice::sample`] still samples a volume at the places on the planes.
    ///
    /// Each tet of the lattice keeps at least a fifth of its volume. Where it would not, the
    /// displacements of its points become shorter, by 15 % at a time. The result does not depend on
    /// the number of threads.
    ///
    /// ```
    /// use cutis_mesh::{Lattice, Split};
    /// use cutis_volume::{Affine, Grid};
    /// use nalgebra::Vector3;
    /// let grid = Grid { shape: [3, 3, 3], affine: Affine::from_spacing([2.0; 3], [0.0; 3])? };
    /// let lattice = Lattice::new(grid, Split::Kuhn6)?.with_moves(vec![13], vec![Vector3::x() * 0.5])?;
    /// assert_eq!(lattice.mm([1, 1, 1]), [2.5, 2.0, 2.0].into());
    /// assert_eq!(lattice.mm([1, 1, 2]), [2.0, 2.0, 4.0].into());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`MeshError::Length`] if the arrays differ in length. [`MeshError::Move`] if a point does
    /// not exist, is out of order, or has a displacement that is not finite.
    pub fn with_moves(&self, points: Vec<u32>, mm: Vec<Vector3<f64>>) -> Result<Self, MeshError> {
        if points.len() != mm.len() {
            return Err(MeshError::Length { array: "mm", expected: points.len(), found: mm.len() });
        }
        let count = self.grid().len();
        let is_wrong = |n: usize| {
            points[n] as usize >= count
                || (n > 0 && points[n] <= points[n - 1])
                || !mm[n].iter().all(|c| c.is_finite())
        };
        if let Some(position) = (0..points.len()).find(|&n| is_wrong(n)) {
            return Err(MeshError::Move {
                position,
                point: points[position],
                mm: mm[position].into(),
                count,
            });
        }
        let on_planes = self.clone().moved(None);
        let moves = Moves { points, mm, longest_edge_mm: 0.0 }.shortened(&on_planes);
        Ok(on_planes.moved(Some(moves)))
    }

    /// Length of the longest edge at a moved point in mm. It is 0 if no points are moved.
    pub(crate) fn longest_moved_edge_mm(&self) -> f64 {
        self.moves().map_or(0.0, |moves| moves.longest_edge_mm)
    }
}

impl Moves {
    /// Makes moves shorter until all tets of a lattice keep [`LEAST_VOLUME`].
    fn shortened(mut self, lattice: &Lattice) -> Self {
        let all = cells_around(lattice.grid(), &self.points);
        let mut cells = all.clone();
        for round in 0.. {
            let tight = |cell: &usize| self.tight_corners(lattice, *cell);
            let mut tight: Vec<u32> = cells.par_iter().flat_map_iter(tight).collect();
            tight.par_sort_unstable();
            tight.dedup();
            if tight.is_empty() {
                break;
            }
            let factor = if round < ROUNDS { SHORTER } else { 0.0 };
            for &point in &tight {
                if let Ok(n) = self.points.binary_search(&point) {
                    self.mm[n] *= factor;
                }
            }
            cells = cells_around(lattice.grid(), &tight);
        }
        let longest = all.par_iter().map(|&cell| self.cell(lattice, cell).longest_edge(lattice));
        self.longest_edge_mm = longest.reduce(|| 0.0, f64::max);
        self
    }

    fn cell(&self, lattice: &Lattice, cell: usize) -> Cell {
        let grid = lattice.grid();
        let at = grid.point(cell);
        let points: [usize; 8] = std::array::from_fn(|corner| grid.index(Lattice::corner(at, corner as u8)));
        let rest = points.map(|point| lattice.mm(grid.point(point)));
        let moves = points.map(|point| self.of(point));
        Cell { at, points, rest, now: std::array::from_fn(|corner| rest[corner] + moves[corner]) }
    }

    /// The moved corners of the tets of a cell that keep too little volume.
    fn tight_corners(&self, lattice: &Lattice, cell: usize) -> Vec<u32> {
        let Cell { at: [i, j, k], points, rest, now } = self.cell(lattice, cell);
        let mut tight = Vec::new();
        for tet in lattice.cell_tets(i, j, k) {
            if volume(&now, tet) < LEAST_VOLUME * volume(&rest, tet) {
                let corners = tet.iter().map(|&corner| usize::from(corner));
                let moved = corners.filter(|&corner| now[corner] != rest[corner]);
                tight.extend(moved.map(|corner| points[corner] as u32));
            }
        }
        tight
    }
}

/// A lattice cell with moved corners.
struct Cell {
    at: [usize; 3],
    /// Flat indices of the corners.
    points: [usize; 8],
    /// Places of the corners on the planes, in world mm.
    rest: [Point3<f64>; 8],
    /// Moved places of the corners, in world mm.
    now: [Point3<f64>; 8],
}

impl Cell {
    /// Length of the longest edge of the tets in mm.
    fn longest_edge(&self, lattice: &Lattice) -> f64 {
        let [i, j, k] = self.at;
        let tets = lattice.cell_tets(i, j, k).iter();
        let edge = |a: u8, b: u8| (self.now[usize::from(a)] - self.now[usize::from(b)]).norm();
        let edges = tets.flat_map(|tet| (0..4).flat_map(move |a| (0..a).map(move |b| [tet[a], tet[b]])));
        edges.map(|[a, b]| edge(a, b)).fold(0.0, f64::max)
    }
}

/// Six times the volume of a tet of a cell.
fn volume(corners: &[Point3<f64>; 8], tet: &[u8; 4]) -> f64 {
    let [a, b, c, d] = tet.map(|corner| corners[usize::from(corner)]);
    (b - a).dot(&(c - a).cross(&(d - a)))
}

/// The cells with one of these points as a corner, each once and in ascending order. A cell has the
/// flat index of its lowest corner.
fn cells_around(grid: &Grid, points: &[u32]) -> Vec<usize> {
    let around = |&point: &u32| {
        let at = grid.point(point as usize);
        (0..8).filter_map(move |corner: usize| {
            let mut low = at;
            for axis in 0..3 {
                low[axis] = low[axis].checked_sub(corner >> axis & 1)?;
                if low[axis] + 1 >= grid.shape[axis] {
                    return None;
                }
            }
            Some(grid.index(low))
        })
    };
    let mut cells: Vec<usize> = points.par_iter().flat_map_iter(around).collect();
    cells.par_sort_unstable();
    cells.dedup();
    cells
}
