//! Resampling of one z-slab of the output.

use std::ops::Range;

use nalgebra::{Matrix3, Point3, Vector3};

use crate::raster::TetRaster;
use crate::report::ResampleReport;
use crate::sample::trilinear;
use crate::space::IndexSpace;
use crate::warp::Warp;

/// Bits of a voxel's state. The lowest two bits count the body tets that hold it strictly, up to
/// two.
const STRICT_COUNT: u8 = 0b11;
const NEAR: u8 = 1 << 2;
const INSIDE: u8 = 1 << 3;
const MOVED: u8 = 1 << 4;
const VACATED: u8 = 1 << 5;

/// The input of a slab.
pub struct Source<'a> {
    pub warp: &'a Warp<'a>,
    pub space: &'a IndexSpace,
    pub voxels: &'a [i16],
    pub shape: [usize; 3],
    /// Stored value of a vacated voxel.
    pub air: i16,
    /// Range of stored values that are not padding.
    pub scanned: [i16; 2],
}

/// A few slices of output voxels.
pub struct Slab<'a> {
    source: &'a Source<'a>,
    slices: Range<usize>,
    values: &'a mut [i16],
    state: Vec<u8>,
}

impl<'a> Slab<'a> {
    /// A slab of `slices`. `values` are its output voxels and hold the input values.
    pub fn new(source: &'a Source<'a>, slices: Range<usize>, values: &'a mut [i16]) -> Self {
        let state = vec![0; values.len()];
        Self { source, slices, values, state }
    }

    /// The voxels of the slab along each axis.
    fn region(&self) -> [Range<usize>; 3] {
        let [columns, rows, _] = self.source.shape;
        [0..columns, 0..rows, self.slices.clone()]
    }

    /// Position in `values` of the first voxel of row `(j, k)`.
    fn row(&self, j: usize, k: usize) -> usize {
        let [columns, rows, _] = self.source.shape;
        ((k - self.slices.start) * rows + j) * columns
    }

    /// Sets the voxels that a deformed tet owns. Tets must come in ascending order.
    pub fn deform(&mut self, tet: usize) {
        let Source { warp, space, voxels, shape, scanned, .. } = *self.source;
        let vertices = warp.tets[tet].map(|v| v as usize);
        let [a, b, c, d] = vertices;
        let place = |positions: &[Point3<f32>]| {
            [
                space.index(positions[a]),
                space.index(positions[b]),
                space.index(positions[c]),
                space.index(positions[d]),
            ]
        };
        let deformed = place(warp.deformed);
        let Some(raster) = TetRaster::new(&deformed, space.tolerance) else { return };
        let inverse = warp.tet_moved(tet).then(|| RestMap::new(&raster, place(warp.rest)));
        let in_body = tet < warp.body_tets;
        let region = self.region();
        raster.rows(&region, |j, k, row| {
            let row = row.columns();
            let first = self.row(j, k);
            let at = |i: usize| first + i;
            if in_body {
                for state in &mut self.state[at(row.strict.0)..at(row.strict.1)] {
                    *state += u8::from(*state & STRICT_COUNT < 2);
                }
            }
            for i in row.near.0..row.near.1 {
                let inside = (row.inside.0..row.inside.1).contains(&i);
                let claim = if inside { INSIDE } else { NEAR };
                let state = &mut self.state[at(i)];
                // The first tet wins, and a tet that holds the center wins over one that only comes
                // near it.
                if *state & (INSIDE | claim) != 0 {
                    continue;
                }
                *state = *state & !MOVED | claim;
                self.values[at(i)] = match &inverse {
                    None => voxels[i + shape[0] * (j + shape[1] * k)],
                    Some(map) => {
                        *state |= MOVED;
                        let center = [i as f64, j as f64, k as f64];
                        let rest = if inside { map.at(center) } else { map.nearest(raster.lambda(center)) };
                        trilinear(voxels, shape, scanned, rest)
                    }
                };
            }
        });
    }

    /// Sets the voxels to air that a tet covers at rest and no deformed tet covers. Call it after
    /// every [`Slab::deform`].
    pub fn vacate(&mut self, vertices: [u32; 4]) {
        let Source { warp, space, air, .. } = *self.source;
        let rest = vertices.map(|v| space.index(warp.rest[v as usize]));
        let Some(raster) = TetRaster::new(&rest, space.tolerance) else { return };
        let region = self.region();
        raster.rows(&region, |j, k, row| {
            let first = self.row(j, k);
            for at in first + row.near.0..first + row.near.1 {
                if self.state[at] & (NEAR | INSIDE | VACATED) == 0 {
                    self.state[at] = VACATED;
                    self.values[at] = air;
                }
            }
        });
    }

    /// The counts of this slab.
    pub fn report(&self) -> ResampleReport {
        let mut report = ResampleReport::default();
        for &state in &self.state {
            report.covered_voxels += usize::from(state & (NEAR | INSIDE) != 0);
            report.moved_voxels += usize::from(state & MOVED != 0);
            report.vacated_voxels += usize::from(state & VACATED != 0);
            report.folds += usize::from(state & STRICT_COUNT > 1);
        }
        report
    }
}

/// The map from deformed to rest voxel indices inside one tet.
pub struct RestMap {
    corners: [Point3<f64>; 4],
    linear: Matrix3<f64>,
    offset: Vector3<f64>,
}

impl RestMap {
    /// The map of a tet with these corners at rest.
    pub fn new(raster: &TetRaster, corners: [Point3<f64>; 4]) -> Self {
        let mut linear = Matrix3::zeros();
        let mut offset = corners[0].coords;
        for c in 1..4 {
            let edge = corners[c] - corners[0];
            linear += edge * raster.gradient_of(c).transpose();
            offset += edge * raster.constant_of(c);
        }
        Self { corners, linear, offset }
    }

    /// The rest index of a deformed index.
    #[inline]
    pub fn at(&self, index: [f64; 3]) -> [f64; 3] {
        (self.linear * Vector3::from(index) + self.offset).into()
    }

    /// The rest index for a center just outside the tet. The barycentric coordinates are clamped to
    /// the tet, however thin it is.
    fn nearest(&self, lambda: [f64; 4]) -> [f64; 3] {
        let held = lambda.map(|l| l.max(0.0));
        let sum: f64 = held.iter().sum();
        let mut position = Vector3::zeros();
        for c in 0..4 {
            position += self.corners[c].coords * (held[c] / sum);
        }
        position.into()
    }
}
