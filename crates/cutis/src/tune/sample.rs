//! Displacements of one mesh at the vertices of another: by the tetrahedron that a point lies in at rest.

use cutis_mesh::TetMesh;
use nalgebra::{Matrix3, Point3, Vector3};

/// A point that lies outside of all tetrahedra by no more than this share of the nearest one's height takes its displacement from
/// there: the surfaces of two lattices lie within a step of each other, not upon each other.
const OUTSIDE: f64 = 0.5;

/// Finds the tetrahedra at a point.
pub(super) struct Sampler<'a> {
    mesh: &'a TetMesh,
    deformed: &'a [Point3<f32>],
    low: Point3<f64>,
    cell: f64,
    shape: [usize; 3],
    /// Where the tetrahedra of each cell begin in `tets`.
    starts: Vec<u32>,
    tets: Vec<u32>,
}

impl<'a> Sampler<'a> {
    /// For `deformed`, one position per vertex of `mesh`.
    pub(super) fn new(mesh: &'a TetMesh, deformed: &'a [Point3<f32>]) -> Self {
        let cell = mesh.lattice.longest_step_mm() / 1000.0;
        let hull = |pick: fn(f64, f64) -> f64, start: f64| {
            mesh.positions.iter().fold(Point3::from([start; 3]), |hull, position| {
                Point3::from(hull.coords.zip_map(&position.coords, |a, b| pick(a, f64::from(b))))
            })
        };
        let margin = Vector3::repeat(cell);
        let low = hull(f64::min, f64::INFINITY) - margin;
        let high = hull(f64::max, f64::NEG_INFINITY) + margin;
        // No more cells than the lattice has points, give or take the margin.
        let shape = std::array::from_fn(|axis| ((high[axis] - low[axis]) / cell).max(0.0) as usize + 1);
        let mut sampler = Self { mesh, deformed, low, cell, shape, starts: Vec::new(), tets: Vec::new() };
        sampler.fill();
        sampler
    }

    fn fill(&mut self) {
        let mut counts = vec![0_u32; self.shape.iter().product::<usize>() + 1];
        for tet in &self.mesh.tets {
            self.cells_of(tet, &mut |cell| counts[cell + 1] += 1);
        }
        for n in 1..counts.len() {
            counts[n] += counts[n - 1];
        }
        let mut tets = vec![0; counts.last().map_or(0, |&count| count as usize)];
        let mut next = counts.clone();
        for (n, tet) in (0..).zip(&self.mesh.tets) {
            self.cells_of(tet, &mut |cell| {
                tets[next[cell] as usize] = n;
                next[cell] += 1;
            });
        }
        (self.starts, self.tets) = (counts, tets);
    }

    /// Calls `found` with each cell that a tetrahedron, half a step wider on all sides, may reach.
    fn cells_of(&self, tet: &[u32; 4], found: &mut dyn FnMut(usize)) {
        let corners = tet.map(|v| self.mesh.positions[v as usize].cast::<f64>());
        let range: [(usize, usize); 3] = std::array::from_fn(|axis| {
            let values = corners.map(|corner| corner[axis]);
            let low = values.into_iter().fold(f64::INFINITY, f64::min) - 0.5 * self.cell;
            let high = values.into_iter().fold(f64::NEG_INFINITY, f64::max) + 0.5 * self.cell;
            (self.place(low, axis), self.place(high, axis))
        });
        for k in range[2].0..=range[2].1 {
            for j in range[1].0..=range[1].1 {
                for i in range[0].0..=range[0].1 {
                    found(i + self.shape[0] * (j + self.shape[1] * k));
                }
            }
        }
    }

    fn place(&self, value: f64, axis: usize) -> usize {
        (((value - self.low[axis]) / self.cell).max(0.0) as usize).min(self.shape[axis] - 1)
    }

    /// The displacement of a point of this mesh's frame, metres: zero where there is no tetrahedron near.
    pub(super) fn displacement(&self, point: Point3<f64>) -> Vector3<f32> {
        let [i, j, k] = std::array::from_fn(|axis| self.place(point[axis], axis));
        let cell = i + self.shape[0] * (j + self.shape[1] * k);
        let (from, to) = (self.starts[cell] as usize, self.starts[cell + 1] as usize);
        let mut best = (-OUTSIDE, Vector3::zeros());
        for &n in &self.tets[from..to] {
            let tet = self.mesh.tets[n as usize];
            let Some(weights) = self.weights(&tet, point) else { continue };
            let least = weights.into_iter().fold(f64::INFINITY, f64::min);
            if least > best.0 {
                let moved =
                    |v: u32| (self.deformed[v as usize] - self.mesh.positions[v as usize]).cast::<f64>();
                let mean = tet.into_iter().zip(weights).map(|(v, weight)| moved(v) * weight).sum();
                best = (least, mean);
            }
        }
        best.1.cast()
    }

    /// Barycentric coordinates at rest; none for a tetrahedron without volume.
    fn weights(&self, tet: &[u32; 4], point: Point3<f64>) -> Option<[f64; 4]> {
        let [a, b, c, d] = tet.map(|v| self.mesh.positions[v as usize].cast::<f64>());
        let inverse = Matrix3::from_columns(&[b - a, c - a, d - a]).try_inverse()?;
        let [u, v, w]: [f64; 3] = (inverse * (point - a)).into();
        Some([1.0 - u - v - w, u, v, w])
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::body::Body;
    use crate::scene::Scene;
    use crate::source;

    fn body(spacing_mm: f64) -> Body {
        let text = format!(
            "volume = {{ phantom = {{ size = [32, 32, 24], seed = 1 }} }}\nlattice = {{ spacing_mm = {spacing_mm} }}"
        );
        let loaded = Scene::parse(&text, Path::new("test"), Path::new(""), &[]).unwrap();
        Body::build(&loaded, &source::load(&loaded).unwrap().volume).unwrap()
    }

    /// A displacement that is linear in the place, in mm, comes out as it is on any other lattice; what is far away does not move.
    #[test]
    fn a_linear_displacement_is_found_on_another_lattice() {
        let (fine, coarse) = (body(14.0), body(19.0));
        let moved = |mm: Point3<f64>| Vector3::new(0.01 * mm.x + 0.02 * mm.z, 1e-3 * mm.y, 0.5);
        let deformed = |body: &Body| -> Vec<Point3<f32>> {
            let place = |&x: &Point3<f32>| x + (moved(body.mesh.frame.to_mm(x)) * 1e-3).cast::<f32>();
            body.mesh.positions.iter().map(place).collect()
        };
        for (from, to) in [(&fine, &fine), (&coarse, &fine), (&fine, &coarse)] {
            let deformed = deformed(from);
            let sampler = Sampler::new(&from.mesh, &deformed);
            let (mut near, mut missed) = (0, 0);
            for &x in &to.mesh.positions {
                let mm = to.mesh.frame.to_mm(x);
                let found = sampler.displacement(from.mesh.frame.to_local(mm).cast()).cast::<f64>() * 1e3;
                match (found - moved(mm)).norm() < 1e-3 {
                    true => near += 1,
                    false => missed += usize::from(found == Vector3::zeros()),
                }
            }
            let all = to.mesh.positions.len();
            assert_eq!(near + missed, all, "a displacement that is neither right nor none");
            assert!(missed * 20 < all && (missed == 0 || !std::ptr::eq(from, to)), "{missed} of {all}");
        }
        let still = deformed(&fine);
        assert_eq!(
            Sampler::new(&fine.mesh, &still).displacement(Point3::new(9.0, 9.0, 9.0)),
            Vector3::zeros()
        );
    }
}
