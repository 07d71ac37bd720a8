//! Meshes whose divided tets are replaced by copies.

use crate::TetMesh;
use crate::sever::{Classes, Wound};

/// The vertices and elements of a mesh that came with copies of divided tets. They follow those of
/// the mesh before.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Copies {
    /// Number of vertices that are not virtual.
    pub vertices: usize,
    /// Number of tets that are whole.
    pub tets: usize,
    /// Number of edges that no divided tet has.
    pub edges: usize,
    /// Number among the copies of its tet, and share of the tet's volume, of each later tet.
    pub(crate) of_tets: Vec<(u8, f32)>,
    /// Number among the copies of its edge, and volume in m³, of each later edge.
    pub(crate) of_edges: Vec<(u8, f32)>,
}

impl TetMesh {
    /// Replaces the divided tets by their copies, and the edges of these tets by those of the
    /// copies. Virtual nodes become vertices, so that all vertices keep their numbers.
    ///
    /// `wound` is a wound of this mesh ([`Severing::wound`](crate::sever::Severing::wound)). A mesh
    /// can be divided once.
    ///
    /// # Panics
    /// If the mesh has copies.
    pub fn divide(&mut self, wound: &Wound) {
        assert!(self.copies.is_none(), "a divided mesh cannot be divided again");
        if wound.split.is_empty() {
            return;
        }
        let vertices = self.positions.len();
        let mut split = wound.split.iter().map(|split| split.tet as usize).peekable();
        let mut number = 0;
        self.tets.retain(|_| {
            number += 1;
            split.next_if_eq(&(number - 1)).is_none()
        });
        let mut split = wound.split_edges.iter().peekable();
        self.edges.retain(|edge| split.next_if(|other| *other == edge).is_none());
        let kept = || wound.copies.iter().filter(|copy| copy.gone.is_none());
        self.copies = Some(Copies {
            vertices,
            tets: self.tets.len(),
            edges: self.edges.len(),
            of_tets: kept().map(|copy| (copy.number, copy.share)).collect(),
            of_edges: wound.edges.iter().map(|edge| (edge.number, edge.volume)).collect(),
        });
        self.tets.extend(kept().map(|copy| copy.nodes));
        self.edges.extend(wound.edges.iter().map(|edge| edge.nodes));
        for &twin in &wound.virtual_nodes {
            let twin = twin as usize;
            self.positions.push(self.positions[twin]);
            self.lattice_index.push(self.lattice_index[twin]);
            self.hu.push(self.hu[twin]);
            if let Some(inactive) = &mut self.inactive {
                inactive.border.push(inactive.border[twin]);
            }
        }
    }

    /// Volumes in m³ of the parts of the mesh that share no vertex, the largest first. A cut that
    /// goes through the body adds a part.
    pub fn part_volumes(&self) -> Vec<f64> {
        let mut classes = Classes::new(self.positions.len());
        for tet in &self.tets {
            tet[1..].iter().for_each(|&v| classes.join(tet[0] as usize, v as usize));
        }
        let mut of_root = vec![0.0; self.positions.len()];
        for (tet, volume) in self.tets.iter().zip(self.tet_volumes()) {
            of_root[classes.root(tet[0] as usize)] += f64::from(volume);
        }
        of_root.retain(|&volume| volume > 0.0);
        of_root.sort_by(|a, b| b.total_cmp(a));
        of_root
    }

    /// Number of vertices that are not virtual.
    pub fn real_vertices(&self) -> usize {
        self.copies.as_ref().map_or(self.positions.len(), |copies| copies.vertices)
    }

    /// Number of tets that are whole. Later ones are copies.
    pub fn whole_tets(&self) -> usize {
        self.copies.as_ref().map_or(self.tets.len(), |copies| copies.tets)
    }

    /// Number of edges that no divided tet has.
    pub fn whole_edges(&self) -> usize {
        self.copies.as_ref().map_or(self.edges.len(), |copies| copies.edges)
    }

    /// Number of each tet among the copies of its lattice tet, and its share of the volume: 0 and 1
    /// for a whole one.
    pub(crate) fn copy_of_tet(&self, tet: usize) -> (u8, f32) {
        let copy = |copies: &Copies| copies.of_tets.get(tet.checked_sub(copies.tets)?).copied();
        self.copies.as_ref().and_then(copy).unwrap_or((0, 1.0))
    }

    /// Number of each edge among the copies of its lattice edge: 0 for one without divided tets.
    pub(crate) fn copy_of_edge(&self, edge: usize) -> u8 {
        let copy = |copies: &Copies| copies.of_edges.get(edge.checked_sub(copies.edges)?).copied();
        self.copies.as_ref().and_then(copy).map_or(0, |(number, _)| number)
    }
}
