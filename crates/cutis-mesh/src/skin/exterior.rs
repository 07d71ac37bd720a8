//! The exterior skin: the faces of the body towards outside air.

use crate::Lattice;
use crate::component::Largest;
use crate::neighbors::Neighbors;
use crate::surface::faces;
use crate::tissue_tets::TissueTets;

/// The exterior skin, with flags from which the report computes its coverage.
pub(super) struct Exterior {
    /// Triangles in flat lattice indices, oriented outwards.
    pub triangles: Vec<[u32; 3]>,
    /// One flag per point: true if it is reached from the lateral sides of the box.
    pub outside: Vec<bool>,
    /// One flag per point: true if it is a vertex of the body, or tissue in no tet that a lattice
    /// edge joins to such a vertex.
    pub attached: Vec<bool>,
}

/// The skin of `body`, the largest component of `tissue`.
pub(super) fn find(
    lattice: &Lattice,
    tissue: &TissueTets,
    body: &Largest,
    through_axis: Option<usize>,
) -> Exterior {
    let mut rest = tissue.masks.clone();
    rest.bytes.iter_mut().zip(&body.masks.bytes).for_each(|(rest, body)| *rest &= !body);
    let rest_points = rest.used_points();
    drop(rest);
    let (tissue, body_points) = (&tissue.points, &body.points);
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
    let faces = faces(lattice, &body.masks);
    let triangles = faces.iter().filter(|face| outside[face.opposite]).map(|face| face.triangle).collect();
    Exterior { triangles, outside, attached }
}

/// The index axis whose direction is closest to the third world axis (head to foot).
fn head_foot_axis(lattice: &Lattice) -> usize {
    let cosine = |axis: usize| lattice.grid().affine.step_mm(axis).normalize().z.abs();
    (0..3).fold(2, |best, axis| if cosine(axis) > cosine(best) { axis } else { best })
}

/// Points that are reached from the seeds along lattice edges between points for which `enter` is
/// true.
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
