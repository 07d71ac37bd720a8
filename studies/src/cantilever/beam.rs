//! The beam: lattice, volumes, fixed end, and the system with a material.

use cutis_coloring::Groups;
use cutis_constraints::{Distance, Scalar, Volume, distance_compliance, volume_compliance};
use cutis_mesh::{Lattice, Split, Tissue, TissueMask};
use cutis_newton::{Minimum, Options, Problem};
use cutis_solver::{Stiffness, System, SystemBuilder, Values};
use cutis_volume::{Affine, Grid};
use nalgebra::{Point3, Vector3};
use serde::Serialize;

pub use crate::kit::Failure;

/// Downwards is −y.
pub const GRAVITY_M_S2: [f64; 3] = [0.0, -9.81, 0.0];

/// Material of the beam.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Material {
    /// Young's modulus `E` of the springs, Pa.
    pub youngs_pa: f64,
    /// Bulk modulus `K` of the tetrahedra, Pa.
    pub bulk_pa: f64,
    /// Density, kg/m³.
    pub density_kg_m3: f64,
}

/// A beam along x. The face with the lowest x is fixed.
#[derive(Clone, Serialize)]
pub struct Beam {
    /// Cells along x, y and z.
    pub cells: [usize; 3],
    /// Length of the beam, m.
    pub length_m: f64,
    /// Vertices in m.
    #[serde(serialize_with = "rows")]
    pub positions: Vec<Point3<f64>>,
    /// Two vertices each.
    pub edges: Vec<[u32; 2]>,
    /// Four vertices each.
    pub tets: Vec<[u32; 4]>,
    /// A sixth of each tetrahedron around an edge, m³.
    pub edge_volumes: Vec<f64>,
    /// Volume of each tetrahedron, m³.
    pub tet_volumes: Vec<f64>,
    /// A quarter of each tetrahedron around a vertex, m³.
    pub vertex_volumes: Vec<f64>,
    /// True for a fixed vertex.
    pub held: Vec<bool>,
    /// Vertices of the free end.
    pub end: Vec<u32>,
    #[serde(skip)]
    edge_groups: Groups,
    #[serde(skip)]
    tet_groups: Groups,
}

impl Beam {
    /// A beam of cubic cells with sides of 10 mm / `refinement`. `scale` multiplies all lengths.
    ///
    /// # Errors
    /// The lattice is empty or too large.
    pub fn new(cells: [usize; 3], refinement: usize, scale: f64) -> Result<Self, Failure> {
        let spacing_mm = 10.0 / refinement as f64;
        let grid =
            Grid { shape: cells.map(|n| n + 1), affine: Affine::from_spacing([spacing_mm; 3], [0.0; 3])? };
        let lattice = Lattice::new(grid, Split::Kuhn6)?;
        let count = lattice.grid().len();
        let tissue = Tissue { air: &vec![false; count], cut_away: &[], largest_component: false };
        let mesh = TissueMask::find(&lattice, &tissue)?.mesh(&vec![0.0; count])?;
        let column = |v: usize| mesh.point(v as u32)[0];
        let volume = |volumes: Vec<f32>| volumes.into_iter().map(|v| f64::from(v) * scale.powi(3)).collect();
        Ok(Self {
            cells,
            length_m: cells[0] as f64 * spacing_mm / 1000.0 * scale,
            positions: mesh.positions.iter().map(|p| p.map(|x| f64::from(x) * scale)).collect(),
            edge_volumes: volume(mesh.edge_volumes()),
            tet_volumes: volume(mesh.tet_volumes()),
            vertex_volumes: volume(mesh.masses(&|_| 1.0)),
            held: (0..count).map(|v| column(v) == 0).collect(),
            end: (0..count as u32).filter(|&v| column(v as usize) == cells[0]).collect(),
            edge_groups: Groups::from_colors(&mesh.edge_colors())?,
            tet_groups: Groups::from_colors(&mesh.tet_colors())?,
            edges: mesh.edges,
            tets: mesh.tets,
        })
    }

    /// The system of the beam: for PBD if a stiffness is given, otherwise with the compliances of
    /// the material.
    ///
    /// # Errors
    /// The material is not valid.
    pub fn system<T: Scalar>(&self, material: &Material, pbd: Option<f64>) -> Result<System<T>, Failure> {
        let inverse_mass = |(&held, volume): (&bool, &f64)| {
            if held { 0.0 } else { 1.0 / (volume * material.density_kg_m3) }
        };
        let inverse_masses: Vec<f64> = self.held.iter().zip(&self.vertex_volumes).map(inverse_mass).collect();
        let (springs, solids) = match pbd {
            Some(stiffness) => {
                (Stiffness::pbd(T::constant(stiffness)), Stiffness::pbd(T::constant(stiffness)))
            }
            None => {
                let length =
                    |[a, b]: [u32; 2]| (self.positions[a as usize] - self.positions[b as usize]).norm();
                let spring = |(&edge, &volume)| distance_compliance(length(edge), material.youngs_pa, volume);
                let springs = self.edges.iter().zip(&self.edge_volumes).map(spring);
                let solids =
                    self.tet_volumes.iter().map(|&volume| volume_compliance(volume, material.bulk_pa));
                (each(springs)?, each(solids)?)
            }
        };
        Ok(SystemBuilder::<T>::new(&self.positions, &inverse_masses)?
            .add_from_rest::<Distance, 2>(&self.edges, &Default::default(), springs, &self.edge_groups)?
            .add_from_rest::<Volume, 4>(&self.tets, &Default::default(), solids, &self.tet_groups)?
            .build())
    }

    /// The beam at rest by Newton's method.
    ///
    /// # Errors
    /// The material is not valid, or the search does not converge.
    pub fn equilibrium(&self, material: &Material, gravity_m_s2: [f64; 3]) -> Result<Minimum, Failure> {
        let problem = Problem::of(&self.system::<f64>(material, None)?, gravity_m_s2)?;
        Ok(problem.equilibrium(&self.positions, &Options::default())?)
    }

    /// Mean displacement of the free end over the length of the beam.
    ///
    /// # Panics
    /// The number of positions is not the number of vertices.
    pub fn end_displacement(&self, positions: &[Point3<f64>]) -> Vector3<f64> {
        assert_eq!(positions.len(), self.positions.len(), "one position per vertex");
        let displacement = |&v: &u32| positions[v as usize] - self.positions[v as usize];
        self.end.iter().map(displacement).sum::<Vector3<f64>>() / (self.end.len() as f64 * self.length_m)
    }

    /// The same beam without the volume constraint of one tetrahedron, for controls.
    ///
    /// # Errors
    /// The coloring fails. This does not happen, because the mesh is valid.
    pub fn without_tet(&self, tet: usize) -> Result<Self, Failure> {
        let mut beam = self.clone();
        beam.tets.remove(tet);
        beam.tet_volumes.remove(tet);
        beam.tet_groups = cutis_coloring::greedy(&beam.tets, beam.positions.len())?;
        Ok(beam)
    }
}

/// The stiffness with one compliance for each constraint.
fn each<T: Scalar, E: Into<Failure>>(
    compliances: impl Iterator<Item = Result<f64, E>>,
) -> Result<Stiffness<T>, Failure> {
    let each: Result<Vec<T>, E> = compliances.map(|c| c.map(T::constant)).collect();
    Ok(Stiffness::Compliance(Values::Each(each.map_err(Into::into)?)))
}

fn rows<S: serde::Serializer>(points: &[Point3<f64>], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(points.iter().map(|p| [p.x, p.y, p.z]))
}
