//! Bit masks of the tets that are present in each cell.

use rayon::prelude::*;

use crate::Lattice;
use crate::stencil::Stencil;

/// One byte per cell with one bit per tet.
///
/// A layer of empty cells surrounds the lattice, so that reading a neighboring cell needs no bounds
/// check.
#[derive(Clone)]
pub(crate) struct CellMasks {
    pub stencil: &'static Stencil,
    /// Cells per axis, without the border.
    pub shape: [usize; 3],
    pub bytes: Vec<u8>,
}

impl CellMasks {
    pub fn empty(lattice: &Lattice) -> Self {
        let shape = lattice.cells();
        let bytes = vec![0; shape.iter().map(|n| n + 2).product()];
        Self { stencil: lattice.stencil(), shape, bytes }
    }

    /// The masks of the tets whose four corners are all `present`.
    pub fn of_points(lattice: &Lattice, present: &[bool]) -> Self {
        let mut masks = Self::empty(lattice);
        let [cx, cy, cz] = masks.shape;
        let (row, stencil) = (cx + 2, masks.stencil);
        let corners = CornerBits::new(lattice, present);
        masks.bytes.par_chunks_mut(row * (cy + 2)).skip(1).take(cz).enumerate().for_each(|(k, layer)| {
            for (j, row) in layer.chunks_exact_mut(row).skip(1).take(cy).enumerate() {
                corners
                    .for_row(j, k, |i, bits| row[i + 1] = stencil.kept[(i + j + k) & 1][usize::from(bits)]);
            }
        });
        masks
    }

    /// Position of a cell in `bytes`.
    pub fn flat(&self, [i, j, k]: [usize; 3]) -> usize {
        (i + 1) + (self.shape[0] + 2) * ((j + 1) + (self.shape[1] + 2) * (k + 1))
    }

    /// Difference between the positions of two cells.
    pub fn delta(&self, [i, j, k]: [i8; 3]) -> isize {
        let (row, column) = (self.shape[0] as isize + 2, self.shape[1] as isize + 2);
        i as isize + row * (j as isize + column * k as isize)
    }

    /// Number of tets present.
    pub fn tet_count(&self) -> usize {
        self.tets_per_layer().iter().sum()
    }

    /// Number of tets present in each layer of cells.
    pub fn tets_per_layer(&self) -> Vec<usize> {
        let layer = (self.shape[0] + 2) * (self.shape[1] + 2);
        let counts = self.bytes.par_chunks(layer).skip(1).take(self.shape[2]);
        counts.map(|layer| layer.iter().map(|mask| mask.count_ones() as usize).sum()).collect()
    }

    /// Calls `visit(cell, position, mask)` for each cell of a layer that has tets, in lattice
    /// order.
    pub fn for_layer(&self, k: usize, mut visit: impl FnMut([usize; 3], usize, u8)) {
        for j in 0..self.shape[1] {
            let start = self.flat([0, j, k]);
            for (i, &mask) in self.bytes[start..start + self.shape[0]].iter().enumerate() {
                if mask != 0 {
                    visit([i, j, k], start + i, mask);
                }
            }
        }
    }

    /// One flag per lattice point: true if the point is a corner of a present tet.
    pub fn used_points(&self) -> Vec<bool> {
        let [cx, cy, cz] = self.shape;
        let mut used = vec![false; (cx + 1) * (cy + 1) * (cz + 1)];
        used.par_chunks_mut((cx + 1) * (cy + 1)).enumerate().for_each(|(k, layer)| {
            let mut mark = |cell_k: usize, upper: u8| {
                self.for_layer(cell_k, |[i, j, _], _, mask| {
                    let corners =
                        self.stencil.corners[(i + j + cell_k) & 1][usize::from(mask)] >> (4 * upper);
                    for corner in 0..4 {
                        layer[i + (corner & 1) + (cx + 1) * (j + (corner >> 1))] |=
                            corners >> corner & 1 == 1;
                    }
                });
            };
            if k > 0 {
                mark(k - 1, 1);
            }
            if k < cz {
                mark(k, 0);
            }
        });
        used
    }
}

/// Reads the flags at the eight corners of a cell as one byte.
pub(crate) struct CornerBits<'a> {
    points: &'a [bool],
    shape: [usize; 3],
}

impl<'a> CornerBits<'a> {
    pub fn new(lattice: &Lattice, points: &'a [bool]) -> Self {
        Self { points, shape: lattice.grid().shape }
    }

    /// Calls `visit(i, bits)` for each cell of row `(j, k)`.
    pub fn for_row(&self, j: usize, k: usize, mut visit: impl FnMut(usize, u8)) {
        let [nx, ny, _] = self.shape;
        let row = |j: usize, k: usize| &self.points[nx * (j + ny * k)..][..nx];
        let rows = [row(j, k), row(j + 1, k), row(j, k + 1), row(j + 1, k + 1)];
        let column = |i: usize| (0..4).fold(0u8, |bits, r| bits | u8::from(rows[r][i]) << (2 * r));
        let mut low = column(0);
        for i in 0..nx - 1 {
            let high = column(i + 1);
            visit(i, low | high << 1);
            low = high;
        }
    }
}
