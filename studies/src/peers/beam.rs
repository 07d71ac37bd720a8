//! The beam in Cutis: the lattice in its own order or shuffled, as a system for each method.
//!
//! `studies/python/_beam.py` builds the same beam, in the same orders.

use std::collections::HashMap;

use cutis_coloring::{Groups, greedy};
use cutis_constraints::{Distance, Volume, distance_compliance, volume_compliance};
use cutis_solver::{Formulation, Stiffness, System, SystemBuilder, Values};
use cutis_test_kit::Kuhn;
use nalgebra::Point3;

use super::job::{DENSITY_KG_M3, Job, Kinds, Order, SPACING_M};
use crate::kit::Failure;

/// Vertices, constraints and their groups.
pub struct Beam {
    positions: Vec<Point3<f64>>,
    edges: Vec<[u32; 2]>,
    tets: Vec<[u32; 4]>,
    /// True for a fixed vertex: those at the lowest x.
    fixed: Vec<bool>,
    /// Vertices at the highest x.
    end: Vec<u32>,
    edge_groups: Groups,
    tet_groups: Groups,
    /// `None` for greedy groups, which the solver finds.
    vertex_groups: Option<Groups>,
}

impl Beam {
    /// The beam with `size` vertices along each axis. The lattice has its groups in closed form,
    /// and the shuffled beam those of greedy coloring.
    ///
    /// # Errors
    /// The coloring fails. This does not happen, because the mesh is valid.
    pub fn new(size: [usize; 3], order: Order) -> Result<Self, Failure> {
        let kuhn = Kuhn::new(size, SPACING_M);
        let column = |v: usize| v % size[0];
        let count = kuhn.positions.len();
        let mut beam = Self {
            fixed: (0..count).map(|v| column(v) == 0).collect(),
            end: (0..count as u32).filter(|&v| column(v as usize) == size[0] - 1).collect(),
            edge_groups: Groups::from_colors(&kuhn.edge_colors)?,
            tet_groups: Groups::from_colors(&kuhn.tet_colors)?,
            vertex_groups: Some(Groups::from_colors(&vertex_colors(size))?),
            positions: kuhn.positions,
            edges: kuhn.edges,
            tets: kuhn.tets,
        };
        if order == Order::Shuffled {
            beam.shuffle()?;
        }
        Ok(beam)
    }

    fn shuffle(&mut self) -> Result<(), Failure> {
        let order = scrambled(self.positions.len());
        let mut place = vec![0; order.len()];
        for (new, &old) in order.iter().enumerate() {
            place[old] = new as u32;
        }
        self.positions = order.iter().map(|&v| self.positions[v]).collect();
        self.fixed = order.iter().map(|&v| self.fixed[v]).collect();
        self.end.iter_mut().for_each(|v| *v = place[*v as usize]);
        self.edges = shuffled(&self.edges, &place);
        self.tets = shuffled(&self.tets, &place);
        self.edge_groups = greedy(&self.edges, place.len())?;
        self.tet_groups = greedy(&self.tets, place.len())?;
        self.vertex_groups = None;
        Ok(())
    }

    /// Numbers of vertices, edges and tetrahedra.
    pub fn sizes(&self) -> [usize; 3] {
        [self.positions.len(), self.edges.len(), self.tets.len()]
    }

    /// Vertices of the free end.
    pub fn end(&self) -> &[u32] {
        &self.end
    }

    /// How far the free end has sunk on average in m, from the positions of [`end`](Self::end).
    pub fn sag_m(&self, end: &[Point3<f32>]) -> f64 {
        let sunk = self.end.iter().zip(end).map(|(&v, x)| self.positions[v as usize].y - f64::from(x.y));
        sunk.sum::<f64>() / end.len() as f64
    }

    /// The system of a job.
    ///
    /// # Errors
    /// A modulus of the job is not valid.
    pub fn system(&self, job: &Job) -> Result<System<f32>, Failure> {
        let volumes = self.volumes();
        let mut masses = vec![0.0; self.positions.len()];
        for (tet, volume) in self.tets.iter().zip(&volumes) {
            tet.iter().for_each(|&v| masses[v as usize] += DENSITY_KG_M3 * volume / 4.0);
        }
        let inverse = |(&fixed, mass): (&bool, f64)| if fixed { 0.0 } else { 1.0 / mass };
        let inverse_masses: Vec<f64> = self.fixed.iter().zip(masses).map(inverse).collect();
        let (springs, solids) = match job.formulation {
            Formulation::Pbd => (Stiffness::pbd(job.stiffness as f32), Stiffness::pbd(job.stiffness as f32)),
            _ => self.compliances(job, &volumes)?,
        };
        let mut builder = SystemBuilder::<f32>::new(&self.positions, &inverse_masses)?;
        if job.kinds != Kinds::Tets {
            builder = builder.add_from_rest::<Distance, 2>(
                &self.edges,
                &Default::default(),
                springs,
                &self.edge_groups,
            )?;
        }
        if job.kinds != Kinds::Edges {
            builder = builder.add_from_rest::<Volume, 4>(
                &self.tets,
                &Default::default(),
                solids,
                &self.tet_groups,
            )?;
        }
        if let Some(groups) = &self.vertex_groups {
            builder = builder.vertex_groups(groups.clone());
        }
        Ok(builder.build())
    }

    /// The compliances of edges and tetrahedra with the moduli of the job.
    fn compliances(&self, job: &Job, volumes: &[f64]) -> Result<(Stiffness<f32>, Stiffness<f32>), Failure> {
        let mut around: HashMap<[u32; 2], f64> = HashMap::new();
        for (tet, volume) in self.tets.iter().zip(volumes) {
            for a in 0..4 {
                for b in 0..a {
                    *around.entry(sorted([tet[a], tet[b]])).or_default() += volume / 6.0;
                }
            }
        }
        let (mut springs, mut solids) = (Vec::new(), Vec::new());
        for &[a, b] in &self.edges {
            let length = (self.positions[a as usize] - self.positions[b as usize]).norm();
            let volume = around[&sorted([a, b])];
            springs.push(distance_compliance(length, job.youngs_pa, volume)? as f32);
        }
        for &volume in volumes {
            solids.push(volume_compliance(volume, job.bulk_pa)? as f32);
        }
        let each = |values| Stiffness::Compliance(Values::Each(values));
        Ok((each(springs), each(solids)))
    }

    /// Volume of each tetrahedron in m³.
    fn volumes(&self) -> Vec<f64> {
        let volume = |tet: &[u32; 4]| {
            let [p, a, b, c] = tet.map(|v| self.positions[v as usize]);
            (a - p).dot(&(b - p).cross(&(c - p))) / 6.0
        };
        self.tets.iter().map(volume).collect()
    }
}

/// The closed form of the groups of vertices: no two vertices of a cube's tetrahedron share one.
fn vertex_colors([nx, ny, nz]: [usize; 3]) -> Vec<u16> {
    let places = (0..nz).flat_map(|k| (0..ny).flat_map(move |j| (0..nx).map(move |i| i + j + k)));
    places.map(|sum| (sum % 4) as u16).collect()
}

/// A fixed order of `count` things, by a hash of their numbers (SplitMix64).
fn scrambled(count: usize) -> Vec<usize> {
    let hash = |n: &usize| {
        let mut z = (*n as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    };
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by_cached_key(hash);
    order
}

/// The tuples with their vertices at new places, in a scrambled order.
fn shuffled<const N: usize>(tuples: &[[u32; N]], place: &[u32]) -> Vec<[u32; N]> {
    scrambled(tuples.len()).into_iter().map(|n| tuples[n].map(|v| place[v as usize])).collect()
}

fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shuffled_beam_is_the_same_body() {
        let [lattice, shuffled] =
            [Order::Lattice, Order::Shuffled].map(|order| Beam::new([5, 4, 3], order).unwrap());
        assert_eq!(lattice.sizes(), shuffled.sizes());
        assert_ne!(lattice.positions, shuffled.positions);
        let total = |beam: &Beam| beam.volumes().iter().sum::<f64>();
        assert!((total(&lattice) - 0.4 * 0.3 * 0.2).abs() < 1e-12);
        assert!((total(&shuffled) - total(&lattice)).abs() < 1e-12);
        for beam in [&lattice, &shuffled] {
            assert!(beam.volumes().iter().all(|&volume| volume > 0.0));
            assert!(beam.end.iter().all(|&v| beam.positions[v as usize].x > 0.399));
            let fixed = beam.fixed.iter().zip(&beam.positions);
            assert!(fixed.into_iter().all(|(&fixed, x)| fixed == (x.x == 0.0)));
            beam.edge_groups.verify(&beam.edges, 60).unwrap();
            beam.tet_groups.verify(&beam.tets, 60).unwrap();
        }
    }

    #[test]
    fn a_scrambled_order_has_every_number_once() {
        let mut order = scrambled(1000);
        assert_ne!(order, (0..1000).collect::<Vec<_>>());
        order.sort_unstable();
        assert_eq!(order, (0..1000).collect::<Vec<_>>());
    }
}
