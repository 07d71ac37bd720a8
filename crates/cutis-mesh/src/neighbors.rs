//! The neighbors of lattice points along lattice edges.

use crate::Lattice;

/// Enumerates the neighbors of lattice points.
pub(crate) struct Neighbors {
    shape: [usize; 3],
    steps: [Vec<([i8; 3], isize)>; 2],
}

impl Neighbors {
    pub fn new(lattice: &Lattice) -> Self {
        let shape = lattice.grid().shape;
        let flat = |[i, j, k]: [i8; 3]| {
            i as isize + shape[0] as isize * (j as isize + shape[1] as isize * k as isize)
        };
        // Each step also exists in the opposite direction: diagonals join points of equal parity,
        // and every point has the axis steps.
        let steps = lattice.stencil().directions.each_ref().map(|directions| {
            let both = directions.iter().flat_map(|d| [d.step, d.step.map(|s| -s)]);
            both.map(|step| (step, flat(step))).collect()
        });
        Self { shape, steps }
    }

    /// Calls `visit` for each neighbor of a point.
    pub fn of(&self, point: usize, mut visit: impl FnMut(usize)) {
        let [nx, ny, _] = self.shape;
        let at = [point % nx, point / nx % ny, point / (nx * ny)];
        let inner = (0..3).all(|axis| at[axis] > 0 && at[axis] + 1 < self.shape[axis]);
        for &(step, delta) in &self.steps[at.iter().sum::<usize>() & 1] {
            let within = |axis: usize| {
                at[axis].checked_add_signed(isize::from(step[axis])).is_some_and(|to| to < self.shape[axis])
            };
            if inner || (0..3).all(within) {
                visit(point.wrapping_add_signed(delta));
            }
        }
    }
}
