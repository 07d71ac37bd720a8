//! The displacement between the two shapes of a body, at the points of a grid.
//!
//! The points are taken slab by slab, so that a field of a large grid need not be in memory.

use cutis_volume::Grid;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::slabs::{SLAB, Slabs};
use crate::space::IndexSpace;
use crate::tet_map::TetMap;
use crate::{ResampleError, Warp};

/// Largest number of slabs in memory at once, and of their points unless one slab has more. A
/// point takes 14 bytes.
const BATCH: usize = 16;
const BATCH_POINTS: usize = 1 << 24;

/// What covers a point of a grid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Coverage {
    /// Neither shape of the body: nothing is known to move here. The displacement is 0.
    #[default]
    Outside = 0,
    /// A tet of the shape that the field starts from.
    Inside = 1,
    /// No tet, but tissue was here at rest: an open wound, or where the body has withdrawn. In a
    /// field that starts from the rest shape: tissue that was cut away. The displacement is 0.
    Vacated = 2,
}

/// The displacement field of a warp on a grid.
///
/// A point that a tet holds has the displacement of the tet there. If several tets hold it, the one
/// with the lowest index counts, as in [`resample`](crate::resample). All other points have the
/// displacement 0. Their [`Coverage`] says why.
///
/// ```
/// use cutis_resample::{Coverage, Displacement, Warp};
/// use cutis_volume::{Affine, Grid};
/// use nalgebra::Point3;
///
/// let grid = Grid { shape: [4, 4, 4], affine: Affine::from_spacing([1.0; 3], [0.0; 3])? };
/// // One tet in local meters, moved by 2 mm along x.
/// let rest = [[0.0; 3], [0.001, 0.0, 0.0], [0.0, 0.001, 0.0], [0.0, 0.0, 0.001]].map(Point3::from);
/// let deformed = rest.map(|p| Point3::new(p.x + 0.002, p.y, p.z));
/// let (origin_mm, tets) = (Point3::origin(), [[0, 1, 2, 3]]);
/// let warp = Warp { origin_mm, rest: &rest, deformed: &deformed, tets: &tets, body_tets: 1, removed: &[] };
/// let field = Displacement::to_rest(&grid, &warp)?;
/// let slab = field.slab(0);
/// assert_eq!((slab.coverage[0], slab.vectors_mm[0]), (Coverage::Vacated, [0.0; 3]));
/// assert_eq!((slab.coverage[2], slab.vectors_mm[2].map(f32::round)), (Coverage::Inside, [-2.0, 0.0, 0.0]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Displacement<'a> {
    grid: Grid,
    warp: Warp<'a>,
    space: IndexSpace,
    /// Positions of the shape that the field starts from, and of the one that it leads to.
    ends: [&'a [Point3<f32>]; 2],
    held: Slabs,
    /// Tets at rest whose place may be empty, and the removed ones.
    left: Slabs,
    removed: Slabs,
}

/// Some slices of a field. The arrays have one entry per point, index `i` fastest.
#[derive(Clone, Debug, Default)]
pub struct Slab {
    /// Number of the first point in the grid.
    pub first: usize,
    /// Displacements in mm along R, A, S.
    pub vectors_mm: Vec<[f32; 3]>,
    /// What covers each point.
    pub coverage: Vec<Coverage>,
}

impl<'a> Displacement<'a> {
    /// The field that leads from a point of the deformed shape to its place at rest, as resampling
    /// needs it.
    ///
    /// # Errors
    /// The errors of [`resample`](crate::resample).
    pub fn to_rest(grid: &Grid, warp: &Warp<'a>) -> Result<Self, ResampleError> {
        Self::new(grid, warp, [warp.deformed, warp.rest], true)
    }

    /// The field that leads from a point at rest to its place in the deformed shape.
    ///
    /// # Errors
    /// The errors of [`resample`](crate::resample).
    pub fn from_rest(grid: &Grid, warp: &Warp<'a>) -> Result<Self, ResampleError> {
        Self::new(grid, warp, [warp.rest, warp.deformed], false)
    }

    fn new(
        grid: &Grid,
        warp: &Warp<'a>,
        ends: [&'a [Point3<f32>]; 2],
        leaves: bool,
    ) -> Result<Self, ResampleError> {
        warp.validate()?;
        grid.checked_len().ok_or(cutis_volume::VolumeError::Shape { shape: grid.shape })?;
        let space = IndexSpace::new(&grid.affine, warp.origin_mm, ends);
        let heights = |positions: &[Point3<f32>], tet: &[u32; 4]| {
            let slices = tet.map(|v| space.slice(positions[v as usize]));
            let (low, high) = slices
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &z| (low.min(z), high.max(z)));
            Some([low - space.tolerance, high + space.tolerance])
        };
        let slices = grid.shape[2];
        let held = Slabs::new(warp.tets.len(), slices, |tet| heights(ends[0], &warp.tets[tet]));
        let left = Slabs::new(warp.tets.len(), slices, |tet| {
            (leaves && warp.tet_moved(tet)).then(|| heights(warp.rest, &warp.tets[tet])).flatten()
        });
        let removed = Slabs::new(warp.removed.len(), slices, |tet| heights(warp.rest, &warp.removed[tet]));
        Ok(Self { grid: *grid, warp: *warp, space, ends, held, left, removed })
    }

    /// Number of slabs.
    pub fn slabs(&self) -> usize {
        self.held.len()
    }

    /// One slab of the field.
    ///
    /// # Panics
    /// If there is no slab with this number.
    pub fn slab(&self, number: usize) -> Slab {
        let [columns, rows, slices] = self.grid.shape;
        let first_slice = number * SLAB;
        let count = SLAB.min(slices - first_slice);
        let shape = [columns, rows, count];
        let points = shape.iter().product();
        let (mut vectors_mm, mut found) = (vec![[0.0; 3]; points], vec![Found::None; points]);
        let map = |ends: [&[Point3<f32>]; 2], tet: &[u32; 4]| {
            let places = tet.map(|v| {
                let mut place = self.space.index(ends[0][v as usize]);
                place.z -= first_slice as f64;
                place
            });
            let moves = tet.map(|v| {
                let [here, there] = ends.map(|positions| positions[v as usize].map(f64::from));
                (there - here) * 1000.0
            });
            TetMap::new(&places, &moves, self.space.tolerance)
        };
        for &tet in self.held.tets(number) {
            let Some(map) = map(self.ends, &self.warp.tets[tet as usize]) else { continue };
            map.points(shape, |index, place, is_inside| {
                let found = &mut found[index];
                // A tet that holds a point wins over one that only comes near it. Of several, the
                // first one wins.
                let wins = if is_inside { *found != Found::Inside } else { *found == Found::None };
                if wins {
                    *found = if is_inside { Found::Inside } else { Found::Near };
                    vectors_mm[index] = map.displacement_mm(place, is_inside).map(|c| c as f32).into();
                }
            });
        }
        for (slabs, tets) in [(&self.left, self.warp.tets), (&self.removed, self.warp.removed)] {
            for &tet in slabs.tets(number) {
                let Some(map) = map([self.warp.rest; 2], &tets[tet as usize]) else { continue };
                map.points(shape, |index, _, _| {
                    if found[index] == Found::None {
                        found[index] = Found::Vacated;
                    }
                });
            }
        }
        let coverage = found.into_iter().map(Found::coverage).collect();
        Slab { first: first_slice * columns * rows, vectors_mm, coverage }
    }

    /// Calls `visit` with one slab after the other, which are computed in parallel. `progress(done,
    /// total)` is called after each of `total` parts. The result does not depend on the number of
    /// threads.
    ///
    /// # Errors
    /// The first error of `visit`.
    pub fn for_each<E>(
        &self,
        progress: &(dyn Fn(usize, usize) + Sync),
        mut visit: impl FnMut(&Slab) -> Result<(), E>,
    ) -> Result<(), E> {
        let total = self.slabs();
        let [columns, rows, _] = self.grid.shape;
        let points = columns.saturating_mul(rows).saturating_mul(SLAB);
        let batch = (BATCH_POINTS / points).clamp(1, BATCH);
        for first in (0..total).step_by(batch) {
            let end = total.min(first + batch);
            let slabs: Vec<Slab> = (first..end).into_par_iter().map(|number| self.slab(number)).collect();
            slabs.iter().try_for_each(&mut visit)?;
            progress(end, total);
        }
        Ok(())
    }

    /// The map from a displacement in mm to one in voxels of the grid.
    pub(crate) fn voxels_of(&self, mm: [f32; 3]) -> Vector3<f64> {
        self.space.linear * (Vector3::from(mm).map(f64::from) / 1000.0)
    }
}

/// How a point of a slab is covered so far.
#[derive(Clone, Copy, PartialEq)]
enum Found {
    None,
    Near,
    Inside,
    Vacated,
}

impl Found {
    fn coverage(self) -> Coverage {
        match self {
            Self::None => Coverage::Outside,
            Self::Near | Self::Inside => Coverage::Inside,
            Self::Vacated => Coverage::Vacated,
        }
    }
}
