//! Lattices: grids of points whose cells are split into tetrahedra.

use std::sync::Arc;

use cutis_volume::{Grid, Volume, sample};
use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use crate::MeshError;
use crate::grading::Planes;
use crate::moved::Moves;
use crate::stencil::Stencil;

/// The split of a lattice cell into tetrahedra.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Split {
    /// Six tetrahedra around the main diagonal (Kuhn).
    ///
    /// The diagonal joins the corners with the lowest and the highest index.
    #[default]
    Kuhn6,
    /// Five tetrahedra, mirrored in every other cell.
    ///
    /// One is in the middle and one at each of four corners. Cells with odd `i + j + k` are
    /// mirrored, so that all face diagonals join lattice points with even `i + j + k`.
    Five,
}

/// A grid of at least 2×2×2 points whose cells are split into tetrahedra.
///
/// The corners of a cell are numbered `di + 2 dj + 4 dk`. Corner 0 of the cell `(i, j, k)` is the
/// point `(i, j, k)`.
///
/// The points are evenly spaced, or, in a graded lattice ([`Lattice::graded`]), on planes that are
/// farther apart outside a fine zone. Both kinds have the same cells, tets, neighbors and colors.
/// Only the positions of the points differ. This is also true of a lattice with points that are
/// moved off the planes ([`Lattice::with_moves`]).
#[derive(Clone, Debug, PartialEq)]
pub struct Lattice {
    grid: Grid,
    split: Split,
    planes: Option<Arc<Planes>>,
    moves: Option<Arc<Moves>>,
}

impl Lattice {
    /// Largest number of points. Points have 32-bit indices, and `u32::MAX` means "none".
    pub const MAX_POINTS: usize = (u32::MAX - 1) as usize;

    /// Creates a lattice over the points of `grid`.
    ///
    /// # Errors
    /// [`MeshError::LatticeSize`] if an axis has fewer than 2 points or there are more than
    /// [`Lattice::MAX_POINTS`]. [`MeshError::LatticeExtent`] if the steps or the extent exceed the
    /// range of 32-bit meters.
    pub fn new(grid: Grid, split: Split) -> Result<Self, MeshError> {
        Self::check(&grid, grid.shape)?;
        Ok(Self { grid, split, planes: None, moves: None })
    }

    /// Creates a graded lattice. Its points are the intersections of `planes`, whose positions are
    /// in steps of `even`.
    ///
    /// # Errors
    /// The errors of [`Lattice::new`].
    pub fn graded(even: Grid, split: Split, planes: Planes) -> Result<Self, MeshError> {
        Self::check(&even, even.shape)?;
        let grid = Grid { shape: planes.shape(), affine: even.affine };
        Self::check(&grid, even.shape)?;
        Ok(Self { grid, split, planes: Some(Arc::new(planes)), moves: None })
    }

    /// Checks the limits of [`Lattice::new`]. `even_shape` is the number of points along each axis
    /// of the even lattice.
    fn check(grid: &Grid, even_shape: [usize; 3]) -> Result<(), MeshError> {
        let shape = grid.shape;
        let points = shape[0].checked_mul(shape[1]).and_then(|n| n.checked_mul(shape[2]));
        if shape.iter().any(|&n| n < 2) || points.is_none_or(|n| n > Self::MAX_POINTS) {
            return Err(MeshError::LatticeSize { shape, max: Self::MAX_POINTS });
        }
        let spacing_mm = grid.affine.spacing_mm();
        let extent =
            even_shape.iter().zip(spacing_mm).map(|(&n, step)| n as f64 * step / 1000.0).sum::<f64>();
        // Volumes are products of three lengths. The cubes of step and extent must be normal f32
        // numbers.
        let smallest = spacing_mm.iter().fold(f64::INFINITY, |a, &b| a.min(b)) / 1000.0;
        let in_range = |length: f64| (1e-12..=1e12).contains(&length);
        if !in_range(smallest) || !in_range(extent) {
            return Err(MeshError::LatticeExtent { spacing_mm, shape });
        }
        Ok(())
    }

    /// The grid that numbers the points. Its affine map has the steps of the fine zone. Use
    /// [`Lattice::mm`] for the positions of points, and [`Grid::view`] to view values per point as
    /// an array.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// World position of a point in mm.
    pub fn mm(&self, point: [usize; 3]) -> Point3<f64> {
        let on_planes = match &self.planes {
            None => self.grid.mm(point),
            Some(planes) => self.grid.affine.to_mm(planes.index(point)),
        };
        match &self.moves {
            None => on_planes,
            Some(moves) => on_planes + moves.of(self.grid.index(point)),
        }
    }

    /// The planes of a graded lattice. `None` for an even lattice.
    pub fn planes(&self) -> Option<&Planes> {
        self.planes.as_deref()
    }

    /// This lattice with these moves only.
    pub(crate) fn moved(self, moves: Option<Moves>) -> Self {
        Self { moves: moves.map(Arc::new), ..self }
    }

    /// The points that lie off the planes. `None` if there are none.
    pub(crate) fn moves(&self) -> Option<&Moves> {
        self.moves.as_deref()
    }

    /// Samples a volume at each point on the planes, in grid order, with the filter of
    /// [`sample::to_grid`] or [`sample::to_planes`].
    ///
    /// # Errors
    /// [`MeshError::Volume`] if the axes of the lattice are not those of the volume.
    pub fn sample(&self, volume: &Volume) -> Result<Vec<f32>, MeshError> {
        let hu = match &self.planes {
            None => sample::to_grid(volume, &self.grid),
            Some(planes) => sample::to_planes(volume, &self.grid, planes.axes()),
        };
        hu.map_err(MeshError::Volume)
    }

    /// The split of the cells.
    pub fn split(&self) -> Split {
        self.split
    }

    /// Number of cells along each axis.
    pub fn cells(&self) -> [usize; 3] {
        self.grid.shape.map(|n| n - 1)
    }

    /// Number of cells.
    pub fn cell_count(&self) -> usize {
        self.cells().iter().product()
    }

    /// Number of tets in all cells.
    pub fn tet_count(&self) -> usize {
        self.cell_count() * self.stencil().tets[0].len()
    }

    /// The tets of a cell as corner numbers `di + 2 dj + 4 dk`, positively oriented in world space.
    ///
    /// A tet `(a, b, c, d)` is positive if `(b − a) · ((c − a) × (d − a)) > 0`. If the affine map
    /// mirrors, the last two corners are swapped.
    ///
    /// ```
    /// use cutis_mesh::{Lattice, Split};
    /// use cutis_volume::{Affine, Grid};
    /// let affine = Affine::from_spacing([1.0, 1.0, 1.0], [0.0; 3])?;
    /// let lattice = Lattice::new(Grid { shape: [3, 3, 3], affine }, Split::Kuhn6)?;
    /// assert_eq!(lattice.cell_tets(0, 1, 0)[0], [0, 1, 3, 7]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn cell_tets(&self, i: usize, j: usize, k: usize) -> &'static [[u8; 4]] {
        &self.stencil().tets[(i + j + k) & 1]
    }

    /// The point at a corner of the cell `(i, j, k)`.
    pub fn corner([i, j, k]: [usize; 3], corner: u8) -> [usize; 3] {
        let c = usize::from(corner);
        [i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)]
    }

    /// Longest of the three lattice steps in mm. On a graded lattice these are the steps of the
    /// fine zone.
    pub fn longest_step_mm(&self) -> f64 {
        self.grid.affine.spacing_mm().into_iter().fold(0.0, f64::max)
    }

    pub(crate) fn stencil(&self) -> &'static Stencil {
        Stencil::of(self.split, self.grid.affine.voxel_volume_mm3() < 0.0)
    }
}
