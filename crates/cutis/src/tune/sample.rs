//! Samples the displacements of one mesh at the vertices of another, through the tetrahedron that
//! contains a point at rest.

use std::ops::Range;

use cutis_mesh::TetMesh;
use nalgebra::{Matrix3, Point3, Vector3};

/// Tolerance for points outside all tetrahedra, relative to the height and to the cell of the
/// nearest one. Within this tolerance a point takes the displacement of that tetrahedron, because
/// the surfaces of two lattices lie within one step of each other but do not coincide.
const OUTSIDE: f64 = 0.5;

/// Finds the tetrahedra at a point by the cell of the lattice that they fill.
pub(super) struct Sampler<'a> {
    mesh: &'a TetMesh,
    deformed: &'a [Point3<f32>],
    /// Positions of the lattice planes along each axis, in steps of its affine map.
    planes: [Vec<f64>; 3],
    /// Offset of each cell's tetrahedra in `tets`.
    starts: Vec<u32>,
    tets: Vec<u32>,
}

impl<'a> Sampler<'a> {
    /// Samples `deformed`, which has one position per vertex of `mesh`.
    pub(super) fn new(mesh: &'a TetMesh, deformed: &'a [Point3<f32>]) -> Self {
        let lattice = &mesh.lattice;
        let planes = match lattice.planes() {
            Some(planes) => planes.axes().clone(),
            None => lattice.grid().shape.map(|n| (0..n).map(|plane| plane as f64).collect()),
        };
        let mut sampler = Self { mesh, deformed, planes, starts: Vec::new(), tets: Vec::new() };
        sampler.fill();
        sampler
    }

    /// Sorts the tetrahedra by cell.
    fn fill(&mut self) {
        let mut starts = vec![0_u32; self.mesh.lattice.cell_count() + 1];
        for tet in &self.mesh.tets {
            starts[self.cell_of(tet) + 1] += 1;
        }
        for cell in 1..starts.len() {
            starts[cell] += starts[cell - 1];
        }
        let mut tets = vec![0; self.mesh.tets.len()];
        let mut next = starts.clone();
        for (n, tet) in (0..).zip(&self.mesh.tets) {
            let place = &mut next[self.cell_of(tet)];
            tets[*place as usize] = n;
            *place += 1;
        }
        (self.starts, self.tets) = (starts, tets);
    }

    /// The cell of a tetrahedron.
    fn cell_of(&self, tet: &[u32; 4]) -> usize {
        let corners = tet.map(|vertex| self.mesh.point(vertex));
        self.number(std::array::from_fn(|axis| {
            corners.iter().map(|corner| corner[axis]).min().unwrap_or_default()
        }))
    }

    fn number(&self, [i, j, k]: [usize; 3]) -> usize {
        let [nx, ny, _] = self.mesh.lattice.cells();
        i + nx * (j + ny * k)
    }

    /// Range of cells along each axis that contain a point or lie within [`OUTSIDE`] of their
    /// length from it; none if the point is far from all cells.
    fn around(&self, mm: Point3<f64>) -> [Range<usize>; 3] {
        let index = self.mesh.lattice.grid().affine.to_index(mm);
        std::array::from_fn(|axis| {
            let (planes, at) = (&self.planes[axis], index[axis]);
            let near = |&cell: &usize| {
                let (low, high) = (planes[cell], planes[cell + 1]);
                let reach = OUTSIDE * (high - low);
                low - reach < at && at < high + reach
            };
            // A step is at most Grading::MOST_GROWTH = 2 times as long as the next, so no other
            // cells are near.
            let above = planes.partition_point(|&plane| plane <= at);
            let cells = above.saturating_sub(2)..(above + 1).min(planes.len() - 1);
            let first = cells.clone().find(near).unwrap_or(cells.end);
            first..cells.rev().find(near).map_or(first, |last| last + 1)
        })
    }

    /// Displacement in meters of a point given in mm; zero if no tetrahedron is near.
    pub(super) fn displacement(&self, mm: Point3<f64>) -> Vector3<f32> {
        let point: Point3<f64> = self.mesh.frame.to_local(mm).cast();
        let [x, y, z] = self.around(mm);
        let mut best = (-OUTSIDE, Vector3::zeros());
        for (k, j) in z.flat_map(|k| y.clone().map(move |j| (k, j))) {
            // The tetrahedra of consecutive cells are consecutive.
            let row = [x.start, x.end].map(|i| self.starts[self.number([i, j, k])] as usize);
            for &n in &self.tets[row[0]..row[1]] {
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
        }
        best.1.cast()
    }

    /// Barycentric coordinates at rest; none for a tetrahedron of zero volume.
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
    use crate::body::{Body, BodySections};
    use crate::ct::source;
    use crate::scene::Scene;

    fn body(lattice: &str) -> Body {
        let text = format!(
            "volume = {{ phantom = {{ size = [32, 32, 24], seed = 1 }} }}\nlattice = {{ {lattice} }}"
        );
        let loaded = Scene::parse(&text, Path::new("test"), Path::new(""), &[]).unwrap();
        Body::build(&BodySections::of(&loaded), &source::load(&loaded).unwrap().volume).unwrap()
    }

    /// A linear displacement field is reproduced on any other lattice. Points far away do not move.
    #[test]
    fn a_linear_displacement_is_found_on_another_lattice() {
        let zone =
            "grading = { min_mm = [20, 80, -20], max_mm = [50, 110, 20], growth = 1.5, coarsest = 3.0 }";
        let (fine, coarse) = (body("spacing_mm = 14.0"), body("spacing_mm = 19.0"));
        let graded = body(&format!("spacing_mm = 6.0, {zone}"));
        let moved = |mm: Point3<f64>| Vector3::new(0.01 * mm.x + 0.02 * mm.z, 1e-3 * mm.y, 0.5);
        let deformed = |body: &Body| -> Vec<Point3<f32>> {
            let place = |&x: &Point3<f32>| x + (moved(body.mesh.frame.to_mm(x)) * 1e-3).cast::<f32>();
            body.mesh.positions.iter().map(place).collect()
        };
        let pairs =
            [(&fine, &fine), (&coarse, &fine), (&fine, &coarse), (&graded, &graded), (&graded, &fine)];
        for (from, to) in pairs {
            let deformed = deformed(from);
            let sampler = Sampler::new(&from.mesh, &deformed);
            let (mut near, mut missed) = (0, 0);
            for &x in &to.mesh.positions {
                let mm = to.mesh.frame.to_mm(x);
                let found = sampler.displacement(mm).cast::<f64>() * 1e3;
                match (found - moved(mm)).norm() < 1e-3 {
                    true => near += 1,
                    false => missed += usize::from(found == Vector3::zeros()),
                }
            }
            let all = to.mesh.positions.len();
            assert_eq!(near + missed, all, "a displacement is neither correct nor zero");
            // Where cells are long, the surface of their tissue lies further inside.
            let most = if std::ptr::eq(from, to) { 0 } else { all / 15 };
            assert!(missed <= most, "{missed} of {all}");
        }
        let (still, graded_still) = (deformed(&fine), deformed(&graded));
        for sampler in [Sampler::new(&fine.mesh, &still), Sampler::new(&graded.mesh, &graded_still)] {
            for far in [9e3, -9e3] {
                assert_eq!(sampler.displacement(Point3::new(far, far, far)), Vector3::zeros());
            }
        }
    }

    /// Outside the surface of a coarse lattice, a point up to half a cell away moves with it.
    #[test]
    fn points_within_half_a_coarse_cell_are_found() {
        let zone =
            "grading = { min_mm = [20, 80, -20], max_mm = [50, 110, 20], growth = 2.0, coarsest = 8.0 }";
        let body = body(&format!("spacing_mm = 6.0, {zone}"));
        let mesh = &body.mesh;
        let by = Vector3::new(0.0, 0.0, 0.25);
        let deformed: Vec<_> = mesh.positions.iter().map(|x| x + by).collect();
        let sampler = Sampler::new(mesh, &deformed);
        // Along z the body ends with the lattice, whose last step is long.
        let [.., z] = &sampler.planes;
        let last = z[z.len() - 1] - z[z.len() - 2];
        assert!(last > 3.0, "{z:?}");
        let at_end = |v: &u32| mesh.point(*v)[2] == z.len() - 1;
        let inner = |tet: &&[u32; 4]| tet.iter().filter(|v| at_end(v)).count() == 3;
        let step = mesh.lattice.grid().affine.step_mm(2) * last;
        for tet in mesh.tets.iter().filter(inner) {
            let end = tet.iter().filter(|v| at_end(v));
            let sum: Vector3<f64> =
                end.map(|&v| mesh.frame.to_mm(mesh.positions[v as usize]).coords / 3.0).sum();
            let beyond = |share: f64| sampler.displacement(Point3::from(sum + step * share));
            assert!((beyond(0.49) - by).norm() < 1e-5);
            assert_eq!(beyond(0.55), Vector3::zeros());
        }
    }
}
