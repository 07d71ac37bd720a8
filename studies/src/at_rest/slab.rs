//! A slab of soft tissue with skin under tension, cut straight across its whole width.

use std::collections::BTreeMap;

use cutis_constraints::{
    Constraint, Distance, SkinStripAtRest, SkinStripLaw, SkinStripMaterial, SkinStripTurn, Volume,
    distance_compliance, volume_compliance,
};
use cutis_newton::{Options as Newton, Problem};
use cutis_solver::SystemBuilder;
use nalgebra::{Point3, Vector3};

use super::add;
use super::block::Elements;
use super::layer::Layer;
use crate::kit::Failure;

/// Length in m and stiffness in N/m of the springs that keep the vertices from moving along the
/// cut. They are so long that they do not resist a motion in the plane across the cut.
const GUIDE: (f64, f64) = (10.0, 1e6);

/// The slab on one side of the cut. Its lattice is `five`, one cell wide, with `x` the distance
/// from the cut. Both sides are mirror planes of the lattice, so that the slab deforms as one
/// without end.
pub struct Slab {
    layer: Layer,
    size: [usize; 3],
    step: f64,
    scan: Vec<Point3<f64>>,
    tets: Vec<[u32; 4]>,
}

impl Slab {
    /// A slab of `columns` cells along x, and `rows` cells over the thickness of the layer.
    pub fn new(layer: Layer, columns: usize, rows: usize) -> Self {
        let (size, step) = ([columns + 1, 2, rows + 1], layer.thickness / rows as f64);
        let vertex = |[i, j, k]: [usize; 3]| (i + size[0] * (j + size[1] * k)) as u32;
        let mut scan = Vec::new();
        let mut tets = Vec::new();
        for (k, j, i) in cells(size) {
            scan.push(Point3::new(i as f64, j as f64, k as f64) * step);
        }
        for (k, _, i) in cells([columns, 1, rows]) {
            let mirror = if (i + k) % 2 == 0 { 0 } else { 7 };
            let corner = |n: usize| {
                let n = n ^ mirror;
                vertex([i + (n & 1), n >> 1 & 1, k + (n >> 2)])
            };
            tets.push([0, 3, 5, 6].map(corner));
            tets.extend([1, 2, 4, 7].map(|n| [n, n ^ 1, n ^ 2, n ^ 4].map(corner)));
        }
        for tet in &mut tets {
            if volume(&tet.map(|v| scan[v as usize])) < 0.0 {
                tet.swap(2, 3);
            }
        }
        Self { layer, size, step, scan, tets }
    }

    /// Displacement of the skin away from the cut in m, at each vertex from the cut on: the mean of
    /// both sides of the slab.
    ///
    /// # Errors
    /// A material is refused, or there is no equilibrium.
    pub fn cut(&self) -> Result<Vec<f64>, Failure> {
        let [columns, _, rows] = self.size.map(|n| n - 1);
        let count = self.scan.len();
        let place = |v: usize| [v % self.size[0], v / self.size[0] % 2, v / self.size[0] / 2];
        let is_free = |v: usize| place(v)[2] > 0 && place(v)[0] < columns;
        let mut positions = self.scan.clone();
        let mut guides = Vec::new();
        for v in (0..count).filter(|&v| is_free(v)) {
            let away = if place(v)[1] == 0 { -GUIDE.0 } else { GUIDE.0 };
            guides.push([v as u32, positions.len() as u32]);
            positions.push(self.scan[v] + Vector3::y() * away);
        }
        let masses: Vec<f64> =
            (0..positions.len()).map(|v| if v < count && is_free(v) { 1.0 } else { 0.0 }).collect();
        let mut loads = vec![Vector3::zeros(); positions.len()];
        for v in (0..count).filter(|&v| place(v)[0] == 0 && place(v)[2] == rows) {
            // Before the cut, the skin on its other side held this vertex. Its load stays.
            loads[v] = Vector3::x() * (self.layer.tension * self.step / 2.0);
        }
        let mut builder = SystemBuilder::<f64>::new(&positions, &masses)?;
        builder = add(builder, &self.guides(&positions, guides))?;
        builder = add(builder, &self.springs()?)?;
        builder = add(builder, &self.volumes()?)?;
        builder = add(builder, &self.strips::<SkinStripAtRest>()?)?;
        builder = add(builder, &self.strips::<SkinStripTurn>()?)?;
        let problem = Problem::of(&builder.loads(&loads)?.build(), [0.0; 3])?;
        let found = problem.equilibrium(&positions, &Newton::default())?.positions;
        let side = |i: usize, j: usize| {
            let v = i + self.size[0] * (j + 2 * rows);
            found[v].x - self.scan[v].x
        };
        Ok((0..=columns).map(|i| 0.5 * (side(i, 0) + side(i, 1))).collect())
    }

    fn corners<const N: usize>(&self, element: &[u32; N]) -> [Point3<f64>; N] {
        element.map(|v| self.scan[v as usize])
    }

    fn guides(&self, positions: &[Point3<f64>], vertices: Vec<[u32; 2]>) -> Elements<Distance, 2> {
        let params = vertices
            .iter()
            .map(|ends| Distance::from_rest(&ends.map(|v| positions[v as usize]), &Default::default()));
        Elements { params: params.collect(), compliances: vec![1.0 / GUIDE.1; vertices.len()], vertices }
    }

    /// Springs whose modulus is fifteen times the shear modulus, with the shares that
    /// `TetMesh::edge_volumes` gives them in `five`.
    fn springs(&self) -> Result<Elements<Distance, 2>, Failure> {
        let mut shares = BTreeMap::<[u32; 2], f64>::new();
        for tet in &self.tets {
            let size = volume(&self.corners(tet));
            let is_middle = size > 0.25 * self.step.powi(3);
            for (a, b) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
                let edge = [tet[a].min(tet[b]), tet[a].max(tet[b])];
                let [start, end] = self.corners(&edge);
                let is_diagonal = (end - start).norm() > 1.2 * self.step;
                let share = match (is_middle, is_diagonal) {
                    (true, _) => 1.0 / 6.0,
                    (false, true) => 7.0 / 30.0,
                    (false, false) => 1.0 / 10.0,
                };
                *shares.entry(edge).or_default() += share * size;
            }
        }
        let modulus = 15.0 * self.layer.shear_modulus;
        let volumes: Vec<f64> = shares.values().copied().collect();
        Elements::new(&self.scan, shares.keys().copied().collect(), |[start, end], n| {
            Ok(distance_compliance((end - start).norm(), modulus, volumes[n])?)
        })
    }

    /// Volumes that make up for what the springs lack of the first Lamé modulus.
    fn volumes(&self) -> Result<Elements<Volume, 4>, Failure> {
        let modulus = self.layer.lame() - self.layer.shear_modulus;
        let compliance = |x: [Point3<f64>; 4], _| Ok(volume_compliance(volume(&x), modulus)?);
        Elements::new(&self.scan, self.tets.clone(), compliance)
    }

    /// A strip across the cut on each triangle of the skin.
    fn strips<C: Constraint<3, Material = SkinStripMaterial>>(&self) -> Result<Elements<C, 3>, Failure> {
        let law = SkinStripLaw {
            tension_n_per_m: self.layer.tension,
            modulus_n_per_m: self.layer.skin_modulus,
            stiffening: 0.0,
            compression: 1.0,
        };
        let material = SkinStripMaterial::new([0.0, 0.0, 1.0], [1.0, 0.0, 0.0], law)?;
        let top = self.layer.thickness - 0.5 * self.step;
        let faces = self.tets.iter().flat_map(|&[a, b, c, d]| [[b, c, d], [a, d, c], [a, b, d], [a, c, b]]);
        let vertices: Vec<[u32; 3]> =
            faces.filter(|face| face.iter().all(|&v| self.scan[v as usize].z > top)).collect();
        let triangles = vertices.iter().map(|triangle| self.corners(triangle));
        let params = triangles.clone().map(|x| C::from_rest(&x, &material)).collect();
        let compliances: Result<_, _> = triangles.map(|x| material.compliance(&x)).collect();
        Ok(Elements { params, compliances: compliances?, vertices })
    }
}

/// Volume of a tetrahedron in m³, negative if it is mirrored.
fn volume([a, b, c, d]: &[Point3<f64>; 4]) -> f64 {
    (b - a).cross(&(c - a)).dot(&(d - a)) / 6.0
}

/// All indices `[k, j, i]` below `size`, the first axis fastest.
fn cells([columns, across, rows]: [usize; 3]) -> impl Iterator<Item = (usize, usize, usize)> {
    (0..rows).flat_map(move |k| (0..across).flat_map(move |j| (0..columns).map(move |i| (k, j, i))))
}
