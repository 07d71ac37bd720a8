//! Rest volumes of tets and edges, and lumped masses.

use std::ops::Range;

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::sever::TetCopy;
use crate::{Split, TetMesh};

impl TetMesh {
    /// Rest volume of each tet in m³. A copy of a divided tet has its share.
    pub fn tet_volumes(&self) -> Vec<f32> {
        (0..self.tets.len()).into_par_iter().map(|tet| self.held_volume(tet) as f32).collect()
    }

    /// Rest volume in m³ that a copy of a divided tet holds.
    pub fn copy_volume(&self, copy: &TetCopy) -> f64 {
        self.volume(&copy.nodes) * f64::from(copy.share)
    }

    fn held_volume(&self, tet: usize) -> f64 {
        self.volume(&self.tets[tet]) * f64::from(self.copy_of_tet(tet).1)
    }

    /// Volume of each edge in m³: its share of each tet around it. The sum is the volume of the
    /// mesh.
    ///
    /// In `kuhn6` each edge has one sixth of a tet. In `five` each edge of a middle tet has one
    /// sixth, and in the tets at the corners each diagonal has 7/30 and each edge along an axis
    /// 1/10. Springs whose stiffness is proportional to these volumes then form an isotropic solid,
    /// if the cells are cubes: over all edges `Σ V e⊗e⊗e⊗e` is isotropic, because the diagonals of
    /// one direction have twice the volume of the edges along one axis.
    pub fn edge_volumes(&self) -> Vec<f32> {
        let vertices = self.positions.len();
        let mut starts = vec![0usize; vertices + 1];
        let whole = self.whole_edges();
        self.edges[..whole].iter().for_each(|edge| starts[edge[0] as usize + 1] += 1);
        (0..vertices).for_each(|v| starts[v + 1] += starts[v]);
        let mut shares = vec![0f64; whole];
        for tet in &self.tets[..self.whole_tets()] {
            let (volume, odd) = (self.volume(tet), self.odd_corners(tet));
            for (a, b) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
                let (low, high) = (tet[a].min(tet[b]), tet[a].max(tet[b]));
                let own = starts[low as usize]..starts[low as usize + 1];
                if let Some(edge) = own.clone().find(|&edge| self.edges[edge][1] == high) {
                    shares[edge] += volume * self.part_of_edge(odd, [a, b]);
                }
            }
        }
        let copies = self.copies.iter().flat_map(|copies| copies.of_edges.iter().map(|(_, volume)| *volume));
        shares.into_iter().map(|share| share as f32).chain(copies).collect()
    }

    /// The share in m³ of a tet's volume that belongs to the edge between two of its corners.
    pub(crate) fn edge_share(&self, tet: &[u32; 4], edge: [usize; 2]) -> f64 {
        self.volume(tet) * self.part_of_edge(self.odd_corners(tet), edge)
    }

    /// The part of a tet's volume that belongs to the edge between two of its corners. `odd` are
    /// its [odd corners](Self::odd_corners).
    fn part_of_edge(&self, odd: [bool; 4], edge: [usize; 2]) -> f64 {
        // In `five` only a tet at a corner has an odd point, and its edges along the axes meet
        // there.
        match self.lattice.split() {
            Split::Five if edge.into_iter().any(|corner| odd[corner]) => 1.0 / 10.0,
            Split::Five if odd.contains(&true) => 7.0 / 30.0,
            Split::Five | Split::Kuhn6 => 1.0 / 6.0,
        }
    }

    /// The corners of a tet whose lattice coordinates have an odd sum.
    fn odd_corners(&self, tet: &[u32; 4]) -> [bool; 4] {
        tet.map(|corner| self.point(corner).iter().sum::<usize>() & 1 == 1)
    }

    /// Lumped mass of each vertex in kg: one quarter of the mass of each tet around it. The density
    /// of a tet in kg/m³ is `density_kg_m3` of the mean HU of its corners.
    ///
    /// A vertex without tets, as in an incision, has mass 0.
    pub fn masses(&self, density_kg_m3: &dyn Fn(f32) -> f32) -> Vec<f32> {
        self.masses_of(0..self.tets.len(), density_kg_m3).into_iter().map(|mass| mass as f32).collect()
    }

    /// The part of each vertex's mass in kg that it has from some tets of the mesh.
    pub fn masses_of(&self, tets: Range<usize>, density_kg_m3: &dyn Fn(f32) -> f32) -> Vec<f64> {
        let mut masses = vec![0f64; self.positions.len()];
        for number in tets {
            let tet = &self.tets[number];
            let quarter = self.held_volume(number) * self.density(tet, density_kg_m3) / 4.0;
            tet.iter().for_each(|&v| masses[v as usize] += quarter);
        }
        masses
    }

    /// Mass in kg of a tet of the lattice with these corners.
    pub fn tet_mass(&self, tet: &[u32; 4], density_kg_m3: &dyn Fn(f32) -> f32) -> f64 {
        self.volume(tet) * self.density(tet, density_kg_m3)
    }

    fn density(&self, tet: &[u32; 4], density_kg_m3: &dyn Fn(f32) -> f32) -> f64 {
        let hu = tet.iter().map(|&v| self.hu[v as usize]).sum::<f32>() / 4.0;
        f64::from(density_kg_m3(hu))
    }

    pub(crate) fn volume(&self, tet: &[u32; 4]) -> f64 {
        let [a, b, c, d] = tet.map(|v| self.positions[v as usize]);
        let from_a = |p: Point3<f32>| -> Vector3<f64> { p.coords.cast::<f64>() - a.coords.cast::<f64>() };
        from_a(b).dot(&from_a(c).cross(&from_a(d))) / 6.0
    }
}
