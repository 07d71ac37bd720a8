//! Graded lattices, whose planes are dense in a fine zone and farther apart outside it.
//!
//! The lattice points are the intersections of the planes of the three axes. Therefore all cells
//! are boxes. There are no hanging vertices, and the split and the colors are those of an even
//! lattice. The disadvantage is that a fine step along one axis extends through the whole lattice.

use std::ops::RangeInclusive;

use cutis_volume::Grid;
use nalgebra::Point3;

use crate::MeshError;

/// The growth of lattice steps away from the fine zone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grading {
    /// Largest ratio of two neighboring steps along an axis. It is above 1 and at most
    /// [`Grading::MOST_GROWTH`].
    pub growth: f64,
    /// Longest step in units of the fine step. It is above 1 and at most [`Grading::MOST_COARSE`].
    /// It also limits the aspect ratio of the cells outside the zone.
    pub coarsest: f64,
}

impl Grading {
    /// Upper limit of `growth`: neighboring steps differ by at most a factor of 2, as in a balanced
    /// octree.
    pub const MOST_GROWTH: f64 = 2.0;
    /// Upper limit of `coarsest`. The smallest dihedral angle of `kuhn6` is then 7° (14° for a
    /// value of 4, 45° in a cube).
    pub const MOST_COARSE: f64 = 8.0;

    fn check(&self) -> Result<(), MeshError> {
        for (key, value, high) in
            [("growth", self.growth, Self::MOST_GROWTH), ("coarsest", self.coarsest, Self::MOST_COARSE)]
        {
            if !(value > 1.0 && value <= high) {
                return Err(MeshError::Grading { key, value, low: 1.0, high });
            }
        }
        Ok(())
    }
}

/// The positions of the planes of a graded lattice, in steps of an even lattice.
#[derive(Clone, Debug, PartialEq)]
pub struct Planes {
    axes: [Vec<f64>; 3],
    fine: [RangeInclusive<usize>; 3],
}

impl Planes {
    /// Computes planes over the extent of the lattice `even`. In the zone `fine` they are the
    /// planes of `even`, outside it there are fewer.
    ///
    /// `fine` holds the start and end of the zone along each axis in steps of `even`, and is
    /// rounded outwards. On each side of the zone there are as few planes as the grading allows.
    /// Their steps grow by one common factor, chosen such that the last plane is the last plane of
    /// `even`.
    ///
    /// ```
    /// use cutis_mesh::{Grading, Planes};
    /// use cutis_volume::{Affine, Grid};
    /// let even = Grid { shape: [41, 5, 5], affine: Affine::from_spacing([4.0; 3], [0.0; 3])? };
    /// let grading = Grading { growth: 1.5, coarsest: 4.0 };
    /// let planes = Planes::new(&even, [[10.0, 16.0], [0.0, 4.0], [0.0, 4.0]], &grading)?;
    /// assert_eq!(planes.shape(), [19, 5, 5]);
    /// assert_eq!(planes.axes()[0].last(), Some(&40.0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`MeshError::LatticeSize`] if `even` has fewer than 2 points along an axis.
    /// [`MeshError::FineZone`] if the zone is empty or outside the lattice. [`MeshError::Grading`]
    /// if a parameter of the grading is out of range.
    pub fn new(even: &Grid, fine: [[f64; 2]; 3], grading: &Grading) -> Result<Self, MeshError> {
        grading.check()?;
        let most = crate::Lattice::MAX_POINTS;
        if even.shape.iter().any(|&n| n < 2 || n > most) {
            return Err(MeshError::LatticeSize { shape: even.shape, max: most });
        }
        let mut planes = Self { axes: [const { Vec::new() }; 3], fine: [0..=0, 0..=0, 0..=0] };
        for axis in 0..3 {
            let (steps, [from, to]) = (even.shape[axis] - 1, fine[axis]);
            let last = steps as f64;
            if !(from <= to && from <= last && to >= 0.0) {
                return Err(MeshError::FineZone { axis, from, to, steps });
            }
            let (first_fine, last_fine) = (from.floor().max(0.0), to.ceil().min(last));
            let below = growing(first_fine, grading);
            let above = growing(last - last_fine, grading);
            let count = (last_fine - first_fine) as usize;
            let mut positions: Vec<f64> = below.iter().rev().map(|distance| first_fine - distance).collect();
            planes.fine[axis] = below.len()..=below.len() + count;
            positions.extend((0..=count).map(|n| first_fine + n as f64));
            positions.extend(above.iter().map(|distance| last_fine + distance));
            planes.axes[axis] = positions;
        }
        Ok(planes)
    }

    /// Number of planes across each axis.
    pub fn shape(&self) -> [usize; 3] {
        self.axes.each_ref().map(Vec::len)
    }

    /// Positions of the planes along each axis, in steps of the even lattice, ascending from 0.
    pub fn axes(&self) -> &[Vec<f64>; 3] {
        &self.axes
    }

    /// True if a point is in the fine zone or on its border.
    pub fn is_fine(&self, point: [usize; 3]) -> bool {
        (0..3).all(|axis| self.fine[axis].contains(&point[axis]))
    }

    /// Position of a point in steps of the even lattice.
    pub(crate) fn index(&self, point: [usize; 3]) -> Point3<f64> {
        Point3::from(std::array::from_fn(|axis| self.axes[axis][point[axis]]))
    }
}

/// Distances of the planes from the fine zone up to `end`, in fine steps. It uses as few planes as
/// possible: each step is at most `growth` times the step before it, and at most `coarsest`.
fn growing(end: f64, grading: &Grading) -> Vec<f64> {
    if end == 0.0 {
        return Vec::new();
    }
    let count = 1 + distances(grading.growth, grading.coarsest).take_while(|reach| *reach < end).count();
    let reach = |growth: f64| distances(growth, grading.coarsest).nth(count - 1).unwrap_or(end);
    // Bisection finds one common growth. With a growth of 1 this number of steps does not reach
    // beyond `end`, which is a whole number.
    let (mut low, mut high) = (1.0, grading.growth);
    loop {
        let middle = f64::midpoint(low, high);
        if middle <= low || middle >= high {
            break;
        }
        if reach(middle) < end { low = middle } else { high = middle }
    }
    let mut distances: Vec<f64> = distances(high, grading.coarsest).take(count).collect();
    if let Some(last) = distances.last_mut() {
        *last = end;
    }
    distances
}

/// Infinite sequence of distances after one step, two steps, and so on.
fn distances(growth: f64, coarsest: f64) -> impl Iterator<Item = f64> {
    let steps =
        std::iter::successors(Some(growth.min(coarsest)), move |step| Some((step * growth).min(coarsest)));
    steps.scan(0.0, |end, step| {
        *end += step;
        Some(*end)
    })
}

#[cfg(test)]
mod tests {
    use cutis_volume::Affine;
    use proptest::prelude::*;

    use super::*;

    fn even(shape: [usize; 3]) -> Grid {
        Grid { shape, affine: Affine::from_spacing([2.0; 3], [0.0; 3]).unwrap() }
    }

    proptest! {
        #[test]
        fn steps_fill_the_extent_and_grow_as_allowed(
            n in 2usize..400, from in -20.0f64..380.0, length in 0.0f64..100.0, growth in 1.01f64..2.0, coarsest in 1.01f64..8.0,
        ) {
            let zone = [from, from + length];
            let grading = Grading { growth, coarsest };
            let all = [0.0, 1.0];
            let Ok(planes) = Planes::new(&even([n, 2, 2]), [zone, all, all], &grading) else {
                prop_assert!(from > (n - 1) as f64 || from + length < 0.0);
                return Ok(());
            };
            let axis = &planes.axes()[0];
            prop_assert_eq!((axis[0], axis[axis.len() - 1]), (0.0, (n - 1) as f64));
            let steps: Vec<f64> = axis.windows(2).map(|w| w[1] - w[0]).collect();
            for (position, step) in axis.windows(2).zip(&steps) {
                let inside = position[0] >= zone[0].floor() && position[1] <= zone[1].ceil();
                prop_assert!(*step > 1.0 - 1e-9 && *step <= coarsest + 1e-9, "{}", step);
                prop_assert!(!inside || *step == 1.0);
            }
            for pair in steps.windows(2) {
                let ratio = (pair[0] / pair[1]).max(pair[1] / pair[0]);
                prop_assert!(ratio <= growth + 1e-6, "{:?}", steps);
            }
            prop_assert!(axis.len() <= n);
        }
    }

    #[test]
    fn invalid_gradings_and_zones_are_refused() {
        let all = [[0.0, 4.0]; 3];
        let grading = |growth, coarsest| Planes::new(&even([5; 3]), all, &Grading { growth, coarsest });
        for (growth, coarsest) in
            [(1.0, 4.0), (2.1, 4.0), (f64::NAN, 4.0), (1.5, 1.0), (1.5, 9.0), (1.5, f64::NAN)]
        {
            assert!(
                matches!(grading(growth, coarsest), Err(MeshError::Grading { .. })),
                "{growth} {coarsest}"
            );
        }
        assert_eq!(grading(1.5, 4.0).unwrap().shape(), [5; 3]);
        let good = Grading { growth: 1.5, coarsest: 4.0 };
        for zone in [[5.0, 6.0], [-3.0, -1.0], [3.0, 2.0], [f64::NAN, 2.0], [0.0, f64::NAN]] {
            let refused = Planes::new(&even([5; 3]), [all[0], zone, all[0]], &good);
            assert!(matches!(refused, Err(MeshError::FineZone { axis: 1, .. })), "{zone:?}");
        }
        assert!(matches!(Planes::new(&even([5, 1, 5]), all, &good), Err(MeshError::LatticeSize { .. })));
    }
}
