//! Blocks that hang from their top face.

use cutis_constraints::{Distance, DistanceMaterial, Volume, VolumeMaterial};
use cutis_solver::{Stiffness, System, SystemBuilder, Values};
use cutis_test_kit::Kuhn;
use nalgebra::Point3;

/// Length of an edge of a block in m.
pub const EDGE: f64 = 0.1;
/// Gravity in m/s².
pub const GRAVITY_M_S2: [f64; 3] = [0.0, 0.0, -9.81];

/// How a block is made.
#[derive(Clone, Copy)]
pub struct Make {
    /// Vertices along an edge.
    pub size: usize,
    /// Young's modulus in Pa.
    pub youngs_modulus_pa: f64,
    /// Bulk modulus over Young's modulus.
    pub incompressibility: f64,
    /// Stiffness of the left half over that of the right half.
    pub contrast: f64,
    /// Whether the top is fixed.
    pub held: bool,
    /// Whether a cut from below ends at half of the height.
    pub cut: bool,
}

impl Default for Make {
    fn default() -> Self {
        let (youngs_modulus_pa, incompressibility) = (1e4, 1.0);
        Self { size: 8, youngs_modulus_pa, incompressibility, contrast: 1.0, held: true, cut: false }
    }
}

impl Make {
    /// The system of the block.
    pub fn system(&self) -> System<f64> {
        let n = self.size;
        let spacing = EDGE / (n - 1) as f64;
        let Kuhn { mut positions, mut tets, .. } = Kuhn::new([n; 3], spacing);
        if self.cut {
            part(&mut positions, &mut tets);
        }
        let mut edges: Vec<[u32; 2]> = tets
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b], [a, c], [a, d], [b, c], [b, d], [c, d]])
            .map(|[a, b]| [a.min(b), a.max(b)])
            .collect();
        edges.sort_unstable();
        edges.dedup();
        let mass = 1000.0 * EDGE.powi(3) / positions.len() as f64;
        let top = EDGE - 0.5 * spacing;
        let fixed = |x: &Point3<f64>| self.held && x.z > top;
        let inverse_masses: Vec<f64> =
            positions.iter().map(|x| if fixed(x) { 0.0 } else { 1.0 / mass }).collect();
        let soft = |vertices: &[u32]| {
            let x = vertices.iter().map(|&v| positions[v as usize].x).sum::<f64>() / vertices.len() as f64;
            if x < 0.5 * EDGE { 1.0 / self.contrast } else { 1.0 }
        };
        // A spring has a share of the volume of the block.
        let share = EDGE.powi(3) / edges.len() as f64;
        let spring = |edge: &[u32; 2]| {
            let length = (positions[edge[0] as usize] - positions[edge[1] as usize]).norm();
            soft(edge) * length * length / (self.youngs_modulus_pa * share)
        };
        let springs = edges.iter().map(spring).collect();
        let bulk = self.youngs_modulus_pa * self.incompressibility;
        let volume = |tet: &[u32; 4]| soft(tet) * spacing.powi(3) / 6.0 / bulk;
        let volumes = tets.iter().map(volume).collect();
        let colors = |tuples: &[[u32; 2]]| cutis_coloring::greedy(tuples, positions.len()).unwrap();
        let edge_groups = colors(&edges);
        let tet_groups = cutis_coloring::greedy(&tets, positions.len()).unwrap();
        let (distance, bulk) = (DistanceMaterial::default(), VolumeMaterial::default());
        SystemBuilder::<f64>::new(&positions, &inverse_masses)
            .unwrap()
            .add_from_rest::<Distance, 2>(
                &edges,
                &distance,
                Stiffness::Compliance(Values::Each(springs)),
                &edge_groups,
            )
            .unwrap()
            .add_from_rest::<Volume, 4>(
                &tets,
                &bulk,
                Stiffness::Compliance(Values::Each(volumes)),
                &tet_groups,
            )
            .unwrap()
            .build()
    }
}

/// Separates the tets on both sides of the middle plane below half of the height.
fn part(positions: &mut Vec<Point3<f64>>, tets: &mut [[u32; 4]]) {
    let middle = 0.5 * EDGE;
    let mut copies = std::collections::BTreeMap::new();
    for tet in tets.iter_mut() {
        let right = tet.iter().map(|&v| positions[v as usize].x - middle).sum::<f64>() > 0.0;
        if !right {
            continue;
        }
        for v in tet {
            let place = positions[*v as usize];
            if (place.x - middle).abs() < 1e-9 && place.z < 0.5 * EDGE {
                *v = *copies.entry(*v).or_insert_with(|| {
                    positions.push(place);
                    positions.len() as u32 - 1
                });
            }
        }
    }
}
