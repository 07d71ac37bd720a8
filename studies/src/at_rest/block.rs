//! A block of tissue with uneven skin on top, under tension in both directions, and a cut through
//! the skin.

use cutis_constraints::{
    Constraint, Distance, SkinStrip, SkinStripLaw, SkinStripMaterial, Volume, distance_compliance,
    volume_compliance,
};
use cutis_test_kit::Kuhn;
use nalgebra::{Point3, Vector3};

use crate::kit::Failure;

/// Vertices along each axis.
pub const SIZE: [usize; 3] = [13, 13, 5];
/// Distance of neighbors in m.
const STEP: f64 = 0.005;
/// Height in m by which every second vertex of the skin lies higher.
const BUMP: f64 = 0.002;
/// Density of the tissue in kg/m³.
const DENSITY: f64 = 1000.0;
/// Young's modulus of the springs and bulk modulus, Pa.
const MODULI: [f64; 2] = [20e3, 50e3];
/// Half the length of the cut, in m. It runs along the middle of the skin, and is one step wide.
const HALF_CUT: f64 = 0.02;

/// Constraints of one type.
pub struct Elements<C: Constraint<N>, const N: usize> {
    /// Vertices of each.
    pub vertices: Vec<[u32; N]>,
    /// Parameters of each.
    pub params: Vec<C::Params<f64>>,
    /// Compliance of each constraint: m/N for springs and strips, m³/Pa for volumes.
    pub compliances: Vec<f64>,
}

/// The block after the cut.
pub struct Block {
    size: [usize; 3],
    /// Positions in the scan, in m.
    pub scan: Vec<Point3<f64>>,
    /// 1/kg; zero at the bottom, which is fixed.
    pub inverse_masses: Vec<f64>,
    /// Springs along the edges.
    pub springs: Elements<Distance, 2>,
    /// Volumes of the tetrahedra.
    pub volumes: Elements<Volume, 4>,
    /// The strips that remain, and those that the cut removed.
    pub strips: [Strips; 2],
}

/// Strips with their materials.
pub struct Strips {
    pub vertices: Vec<[u32; 3]>,
    pub materials: Vec<SkinStripMaterial>,
    /// m/N.
    pub compliances: Vec<f64>,
}

impl Block {
    /// The block of `size` vertices along each axis with a cut, or without one.
    ///
    /// # Errors
    /// A material is refused.
    pub fn new(size: [usize; 3], is_cut: bool) -> Result<Self, Failure> {
        let lattice = Kuhn::new(size, STEP);
        let top = (size[2] - 1) as f64 * STEP;
        let is_top = |x: &Point3<f64>| x.z > top - 0.5 * STEP;
        let mut scan = lattice.positions.clone();
        for x in scan.iter_mut().filter(|x| is_top(x)) {
            let [column, row] = [x.x, x.y].map(|along| (along / STEP).round() as i64);
            x.z += BUMP * ((column + row) % 2) as f64;
        }
        let mut masses = vec![0.0; scan.len()];
        let mut volumes = vec![0.0; lattice.tets.len()];
        for (tet, volume) in lattice.tets.iter().zip(&mut volumes) {
            let [a, b, c, d] = tet.map(|v| scan[v as usize]);
            *volume = (b - a).cross(&(c - a)).dot(&(d - a)) / 6.0;
            tet.iter().for_each(|&v| masses[v as usize] += DENSITY * *volume / 4.0);
        }
        let inverse_masses =
            scan.iter().zip(&masses).map(|(x, mass)| if x.z > 0.0 { 1.0 / mass } else { 0.0 }).collect();
        let inside = top * ((size[0] - 1) * (size[1] - 1)) as f64 * STEP * STEP;
        let edge_volume = inside / lattice.edges.len() as f64;
        let springs = Elements::new(&scan, lattice.edges, |[a, b], _| {
            Ok(distance_compliance((b - a).norm(), MODULI[0], edge_volume)?)
        })?;
        let volumes =
            Elements::new(&scan, lattice.tets.clone(), |_, n| Ok(volume_compliance(volumes[n], MODULI[1])?))?;
        let faces =
            lattice.tets.iter().flat_map(|&[a, b, c, d]| [[b, c, d], [a, d, c], [a, b, d], [a, c, b]]);
        let skin: Vec<[u32; 3]> =
            faces.filter(|face| face.iter().all(|&v| is_top(&lattice.positions[v as usize]))).collect();
        let middle = (size[0] - 1) as f64 * STEP / 2.0;
        let cut = |triangle: &&[u32; 3]| {
            let center =
                triangle.iter().map(|&v| lattice.positions[v as usize].coords).sum::<Vector3<f64>>() / 3.0;
            is_cut && (0.0..STEP).contains(&(center.x - middle)) && (center.y - middle).abs() < HALF_CUT
        };
        let (removed, kept): (Vec<&[u32; 3]>, Vec<_>) = skin.iter().partition(cut);
        let strips = [Strips::new(&scan, &kept)?, Strips::new(&scan, &removed)?];
        Ok(Self { size, scan, inverse_masses, springs, volumes, strips })
    }

    /// The vertices of the skin on both sides of the middle of the cut.
    pub fn lips(&self) -> [Vec<u32>; 2] {
        let [columns, rows, layers] = self.size;
        let lip = |column: usize| {
            let near = rows / 2 - 1..=rows / 2 + 1;
            near.map(|row| (column + columns * (row + rows * (layers - 1))) as u32).collect()
        };
        [lip(columns / 2), lip(columns / 2 + 1)]
    }

    /// The load of the kept strips and of the removed strips on each vertex, N: the negative of
    /// their forces in the scan.
    pub fn loads(&self) -> [Vec<Vector3<f64>>; 2] {
        self.strips.each_ref().map(|strips| {
            let mut loads = vec![Vector3::zeros(); self.scan.len()];
            let elements = strips.of_type::<SkinStrip>(&self.scan);
            for ((vertices, params), compliance) in
                elements.vertices.iter().zip(&elements.params).zip(&elements.compliances)
            {
                let eval = SkinStrip::eval(&vertices.map(|v| self.scan[v as usize]), params);
                for (&v, gradient) in vertices.iter().zip(eval.grad) {
                    loads[v as usize] += gradient * (eval.c / compliance);
                }
            }
            loads
        })
    }
}

impl<C: Constraint<N>, const N: usize> Elements<C, N>
where
    C::Material: Default,
{
    /// Elements with default materials and a compliance each.
    pub fn new(
        scan: &[Point3<f64>],
        vertices: Vec<[u32; N]>,
        compliance: impl Fn([Point3<f64>; N], usize) -> Result<f64, Failure>,
    ) -> Result<Self, Failure> {
        let corners = |element: &[u32; N]| element.map(|v| scan[v as usize]);
        let params = vertices.iter().map(|e| C::from_rest(&corners(e), &Default::default())).collect();
        let compliances: Result<_, _> =
            vertices.iter().enumerate().map(|(n, element)| compliance(corners(element), n)).collect();
        Ok(Self { params, compliances: compliances?, vertices })
    }
}

impl Strips {
    /// Two strips on each triangle, with the tension and the modulus of a trunk.
    fn new(scan: &[Point3<f64>], skin: &[&[u32; 3]]) -> Result<Self, Failure> {
        let mut strips = Self { vertices: Vec::new(), materials: Vec::new(), compliances: Vec::new() };
        for &&triangle in skin {
            for (direction, [tension_n_per_m, modulus_n_per_m]) in
                [([1.0, 0.0, 0.0], [15.0, 60.0]), ([0.0, 1.0, 0.0], [5.0, 40.0])]
            {
                let law =
                    SkinStripLaw { tension_n_per_m, modulus_n_per_m, stiffening: 0.0, compression: 0.0 };
                let material = SkinStripMaterial::new([0.0, 0.0, 1.0], direction, law)?;
                strips.vertices.push(triangle);
                strips.compliances.push(material.compliance(&triangle.map(|v| scan[v as usize]))?);
                strips.materials.push(material);
            }
        }
        Ok(strips)
    }

    /// The strips as constraints of the type `C`.
    pub fn of_type<C: Constraint<3, Material = SkinStripMaterial>>(
        &self,
        scan: &[Point3<f64>],
    ) -> Elements<C, 3> {
        let params = self.vertices.iter().zip(&self.materials);
        let params =
            params.map(|(e, material)| C::from_rest(&e.map(|v| scan[v as usize]), material)).collect();
        Elements { vertices: self.vertices.clone(), params, compliances: self.compliances.clone() }
    }
}
