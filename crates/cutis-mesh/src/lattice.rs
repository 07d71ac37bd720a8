//! A grid of points whose cells are split into tetrahedra.

use std::sync::Arc;

use cutis_volume::{Grid, Volume, sample};
use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use crate::MeshError;
use crate::grading::Planes;
use crate::stencil::Stencil;

/// How a cell is split into tetrahedra.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Split {
    /// Six tets around the diagonal from the cell's lowest-index to its highest-index corner (Kuhn).
    #[default]
    Kuhn6,
    /// A tet in the middle and one at each of four corners, mirrored in cells whose `i + j + k` is odd.
    ///
    /// Face diagonals join lattice vertices whose `i + j + k` is even.
    Five,
}

/// A lattice: a grid of at least 2×2×2 points, and the split of its cells.
///
/// Corners of a cell are numbered `di + 2 dj + 4 dk`; cell `(i, j, k)` has its corner 0 at point `(i, j, k)`.
///
/// The points lie evenly, or ([`Lattice::graded`]) on planes across each axis that are further apart away from a fine zone.
/// Cells, tets, neighbors and colors are the same for both; only the places of the points differ.
#[derive(Clone, Debug, PartialEq)]
pub struct Lattice {
    grid: Grid,
    split: Split,
    planes: Option<Arc<Planes>>,
}

impl Lattice {
    /// Most points a lattice may have: they are numbered in 32 bits, and `u32::MAX` means "none".
    pub const MAX_POINTS: usize = (u32::MAX - 1) as usize;

    /// A lattice over the points of `grid`.
    ///
    /// # Errors
    /// [`MeshError::LatticeSize`] if an axis has fewer than 2 points or there are more than [`Lattice::MAX_POINTS`];
    /// [`MeshError::LatticeExtent`] if positions or steps vanish or overflow in 32-bit meters.
    pub fn new(grid: Grid, split: Split) -> Result<Self, MeshError> {
        Self::check(&grid, grid.shape)?;
        Ok(Self { grid, split, planes: None })
    }

    /// The lattice whose points lie where the planes of `planes` meet; their positions are in steps of `even`.
    ///
    /// # Errors
    /// As [`Lattice::new`], for `even`.
    pub fn graded(even: Grid, split: Split, planes: Planes) -> Result<Self, MeshError> {
        Self::check(&even, even.shape)?;
        let grid = Grid { shape: planes.shape(), affine: even.affine };
        Self::check(&grid, even.shape)?;
        Ok(Self { grid, split, planes: Some(Arc::new(planes)) })
    }

    /// `reach`: points along each axis if they lay evenly.
    fn check(grid: &Grid, reach: [usize; 3]) -> Result<(), MeshError> {
        let shape = grid.shape;
        let points = shape[0].checked_mul(shape[1]).and_then(|n| n.checked_mul(shape[2]));
        if shape.iter().any(|&n| n < 2) || points.is_none_or(|n| n > Self::MAX_POINTS) {
            return Err(MeshError::LatticeSize { shape, max: Self::MAX_POINTS });
        }
        let spacing_mm = grid.affine.spacing_mm();
        let extent = reach.iter().zip(spacing_mm).map(|(&n, step)| n as f64 * step / 1000.0).sum::<f64>();
        // Volumes are products of three lengths: keep the cubes of step and extent within f32's normal range.
        let smallest = spacing_mm.iter().fold(f64::INFINITY, |a, &b| a.min(b)) / 1000.0;
        let holds = |length: f64| (1e-12..=1e12).contains(&length);
        if !holds(smallest) || !holds(extent) {
            return Err(MeshError::LatticeExtent { spacing_mm, shape });
        }
        Ok(())
    }

    /// The numbering of the points, and the affine map of the finest steps. Where a point lies is [`Lattice::mm`].
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// World position of a point, mm.
    pub fn mm(&self, point: [usize; 3]) -> Point3<f64> {
        match &self.planes {
            None => self.grid.mm(point),
            Some(planes) => self.grid.affine.to_mm(planes.index(point)),
        }
    }

    /// The planes of a graded lattice.
    pub fn planes(&self) -> Option<&Planes> {
        self.planes.as_deref()
    }

    /// HU at each point, in the order of the numbering; filtered as [`sample::to_grid`] and [`sample::to_planes`] say.
    ///
    /// # Errors
    /// [`MeshError::File`] if the axes of the lattice are not those of the volume.
    pub fn sample(&self, volume: &Volume) -> Result<Vec<f32>, MeshError> {
        Ok(match &self.planes {
            None => sample::to_grid(volume, &self.grid)?,
            Some(planes) => sample::to_planes(volume, &self.grid, planes.axes())?,
        })
    }

    /// The split.
    pub fn split(&self) -> Split {
        self.split
    }

    /// Cells per axis.
    pub fn cells(&self) -> [usize; 3] {
        self.grid.shape.map(|n| n - 1)
    }

    /// Number of cells.
    pub fn cell_count(&self) -> usize {
        self.cells().iter().product()
    }

    /// Number of tets, tissue or not.
    pub fn tet_count(&self) -> usize {
        self.cell_count() * self.stencil().tets[0].len()
    }

    /// The tets of a cell as corner numbers `di + 2 dj + 4 dk`, positively oriented in world space.
    ///
    /// A tet `(a, b, c, d)` is positive if `(b − a) · ((c − a) × (d − a)) > 0`; for an affine that mirrors, the last two
    /// corners change places.
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

    /// The point at a corner of a cell.
    pub fn corner([i, j, k]: [usize; 3], corner: u8) -> [usize; 3] {
        let c = usize::from(corner);
        [i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)]
    }

    /// Longest of the three lattice steps, mm; on a graded lattice of the steps in its fine zone.
    pub fn longest_step_mm(&self) -> f64 {
        self.grid.affine.spacing_mm().into_iter().fold(0.0, f64::max)
    }

    pub(crate) fn stencil(&self) -> &'static Stencil {
        Stencil::of(self.split, self.grid.affine.voxel_volume_mm3() < 0.0)
    }
}
