//! Finds tets of a mesh by their cell.

use crate::TetMesh;
use crate::cells::CellMasks;
use crate::stencil::Stencil;

/// The position of each tet in [`TetMesh::tets`], by its cell and its number within the cell.
pub(super) struct TetIndex {
    masks: CellMasks,
    /// Position of the first tet of each row of cells.
    rows: Vec<u32>,
}

impl TetIndex {
    pub fn new(mesh: &TetMesh) -> Self {
        let masks = mesh.cell_masks();
        let [_, cy, cz] = masks.shape;
        let mut rows = Vec::with_capacity(cy * cz);
        let mut next = 0;
        for k in 0..cz {
            for j in 0..cy {
                rows.push(next);
                next += Self::row(&masks, j, k).iter().map(|mask| mask.count_ones()).sum::<u32>();
            }
        }
        Self { masks, rows }
    }

    pub fn stencil(&self) -> &'static Stencil {
        self.masks.stencil
    }

    fn row(masks: &CellMasks, j: usize, k: usize) -> &[u8] {
        let start = masks.flat([0, j, k]);
        &masks.bytes[start..start + masks.shape[0]]
    }

    /// Mask of the tets of a cell that exist. Zero for a cell outside the lattice.
    pub fn present(&self, [i, j, k]: [isize; 3]) -> u8 {
        let cell = [i, j, k].map(|c| c as usize);
        let inside = [i, j, k].iter().zip(self.masks.shape).all(|(&c, n)| c >= 0 && (c as usize) < n);
        if inside { self.masks.bytes[self.masks.flat(cell)] } else { 0 }
    }

    /// Position of an existing tet.
    pub fn position(&self, [i, j, k]: [usize; 3], tet: usize) -> u32 {
        let row = Self::row(&self.masks, j, k);
        let before: u32 = row[..i].iter().map(|mask| mask.count_ones()).sum();
        let own = row[i] & ((1 << tet) - 1);
        self.rows[j + self.masks.shape[1] * k] + before + own.count_ones()
    }

    /// The tet on the other side of the face opposite to a corner, if it exists.
    pub fn across(&self, cell: [usize; 3], tet: usize, face: usize) -> Option<([usize; 3], usize)> {
        let neighbor = &self.stencil().neighbors[cell.iter().sum::<usize>() & 1][tet][face];
        let to: [isize; 3] =
            std::array::from_fn(|axis| cell[axis] as isize + isize::from(neighbor.offset[axis]));
        let exists = self.present(to) >> neighbor.tet & 1 == 1;
        exists.then(|| (to.map(|c| c as usize), usize::from(neighbor.tet)))
    }

    /// Calls `visit(cell, tet)` for each existing tet that has the edge from a point along one of
    /// its directions.
    pub fn around_edge(&self, point: [usize; 3], direction: usize, mut visit: impl FnMut([usize; 3], usize)) {
        let parity = point.iter().sum::<usize>() & 1;
        for &(offset, tets) in &self.stencil().directions[parity][direction].cells {
            self.in_cell(point, offset, tets, &mut visit);
        }
    }

    /// Calls `visit(cell, tet)` for each existing tet that has a point as a corner.
    pub fn around_point(&self, point: [usize; 3], mut visit: impl FnMut([usize; 3], usize)) {
        for corner in 0..8_u8 {
            let offset = [0, 1, 2].map(|axis| -((corner >> axis & 1) as i8));
            let parity = (point.iter().sum::<usize>() + corner.count_ones() as usize) & 1;
            let own = self.stencil().tets[parity].iter().enumerate().filter(|(_, tet)| tet.contains(&corner));
            let tets = own.fold(0, |mask, (t, _)| mask | 1 << t);
            self.in_cell(point, offset, tets, &mut visit);
        }
    }

    fn in_cell(
        &self,
        point: [usize; 3],
        offset: [i8; 3],
        tets: u8,
        visit: &mut impl FnMut([usize; 3], usize),
    ) {
        let cell: [isize; 3] = std::array::from_fn(|axis| point[axis] as isize + isize::from(offset[axis]));
        let mut found = self.present(cell) & tets;
        while found != 0 {
            visit(cell.map(|c| c as usize), found.trailing_zeros() as usize);
            found &= found - 1;
        }
    }
}
