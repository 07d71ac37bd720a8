//! The body's faces towards outside air.

use crate::Lattice;
use crate::cells::CellMasks;
use crate::component;
use crate::surface::faces;

/// The exterior skin, and how well it covers the surface between tissue and outside air.
pub(super) struct Exterior {
    /// Flat lattice indices, outward oriented.
    pub triangles: Vec<[u32; 3]>,
    /// Per point: reached from the lateral sides of the box.
    pub outside: Vec<bool>,
    /// Per point: a vertex of the body, or tissue of no other component that a lattice edge joins with one.
    pub attached: Vec<bool>,
    /// Face-connected components of all-tissue tets.
    pub bodies: usize,
}

pub(super) fn find(
    lattice: &Lattice,
    tissue: &[bool],
    masks: &CellMasks,
    through_axis: Option<usize>,
) -> Exterior {
    let largest = component::largest(masks.clone());
    let body = largest.masks;
    let body_points = body.used_points();
    let mut rest = masks.clone();
    rest.bytes.iter_mut().zip(&body.bytes).for_each(|(rest, body)| *rest &= !body);
    let rest_points = rest.used_points();
    let other = |point: usize| rest_points[point] && !body_points[point];
    let through = through_axis.unwrap_or_else(|| head_foot_axis(lattice));
    let shape = lattice.grid().shape;
    let lateral = |point: usize| {
        let p = lattice.grid().point(point);
        (0..3).any(|axis| axis != through && (p[axis] == 0 || p[axis] == shape[axis] - 1))
    };
    let points = 0..lattice.grid().len();
    let passable = |point: usize| !tissue[point] || other(point);
    let outside = flood(lattice, points.clone().filter(|&point| lateral(point)), passable);
    let neighbors = Neighbors::new(lattice);
    let mut attached = body_points.clone();
    for point in points.filter(|&point| tissue[point] && !body_points[point] && !rest_points[point]) {
        neighbors.of(point, |neighbor| attached[point] |= body_points[neighbor]);
    }
    let faces = faces(lattice, &body);
    let triangles = faces.iter().filter(|face| outside[face.opposite]).map(|face| face.triangle).collect();
    Exterior {
        triangles,
        outside,
        attached,
        bodies: if body.tet_count() == 0 { 0 } else { largest.components },
    }
}

/// The index axis whose step is closest in direction to the world's third axis.
fn head_foot_axis(lattice: &Lattice) -> usize {
    let cosine = |axis: usize| lattice.grid().affine.step_mm(axis).normalize().z.abs();
    (0..3).fold(2, |best, axis| if cosine(axis) > cosine(best) { axis } else { best })
}

/// Points reached from the seeds over lattice edges between points that may be entered.
fn flood(lattice: &Lattice, seeds: impl Iterator<Item = usize>, enter: impl Fn(usize) -> bool) -> Vec<bool> {
    let mut reached = vec![false; lattice.grid().len()];
    let mut stack = Vec::new();
    let mut visit = |point: usize, stack: &mut Vec<u32>| {
        if !reached[point] && enter(point) {
            reached[point] = true;
            stack.push(point as u32);
        }
    };
    let neighbors = Neighbors::new(lattice);
    for seed in seeds {
        visit(seed, &mut stack);
        while let Some(point) = stack.pop() {
            neighbors.of(point as usize, |neighbor| visit(neighbor, &mut stack));
        }
    }
    reached
}

/// Lattice edges around a point.
pub(super) struct Neighbors {
    shape: [usize; 3],
    steps: [Vec<([i8; 3], isize)>; 2],
}

impl Neighbors {
    pub fn new(lattice: &Lattice) -> Self {
        let shape = lattice.grid().shape;
        let flat = |[i, j, k]: [i8; 3]| {
            i as isize + shape[0] as isize * (j as isize + shape[1] as isize * k as isize)
        };
        // Diagonals join points of equal parity and every point has the axis steps, so that each step can be walked both ways.
        let steps = lattice.stencil().directions.each_ref().map(|directions| {
            let both = directions.iter().flat_map(|d| [d.step, d.step.map(|s| -s)]);
            both.map(|step| (step, flat(step))).collect()
        });
        Self { shape, steps }
    }

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
