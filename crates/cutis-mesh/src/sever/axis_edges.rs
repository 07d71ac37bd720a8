//! The severed edges along the axes of the lattice.
//!
//! A model without tets, such as ChainMail, joins neighbors along the axes only.

use super::severing::Severing;
use crate::TetMesh;

/// An edge along an axis of the lattice that a blade severs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisEdge {
    /// Its vertices, in the order of their lattice points.
    pub ends: [u32; 2],
    /// Length along the path of the blade, in m, at which it is severed.
    pub at: f64,
}

impl Severing {
    /// For each blade, the edges along the axes that the whole blade severs, in the order in which
    /// it severs them. `mesh` is the mesh of [`Severing::new`].
    pub(super) fn axis_edges(&self, mesh: &TetMesh) -> Vec<Vec<AxisEdge>> {
        let grid = mesh.lattice.grid();
        let edge = |(vertex, direction, at): (u32, u8, f64)| {
            let from = mesh.point(vertex);
            let directions = &self.index.stencil().directions[from.iter().sum::<usize>() & 1];
            let step = directions[usize::from(direction)].step;
            // Two vertices next to each other need not be in one tet.
            let mut held = false;
            self.index.around_edge(from, usize::from(direction), |_, _| held = true);
            let along_axis = held && step.iter().filter(|&&step| step != 0).count() == 1;
            let to = std::array::from_fn(|axis| from[axis].wrapping_add_signed(isize::from(step[axis])));
            along_axis.then(|| AxisEdge { ends: [vertex, self.vertex_of[grid.index(to)]], at })
        };
        self.blades.iter().map(|sides| sides.all_crossings().filter_map(edge).collect()).collect()
    }
}
