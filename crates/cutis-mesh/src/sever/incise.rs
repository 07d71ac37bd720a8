//! Incisions of no width on a mesh with its skin.

use super::blade::{Blade, Station};
use super::growth::Growth;
use super::pieces::Pieces;
use super::severing::{Severing, longest_edge};
use super::wound::TriangleCopy;
use crate::gape::Gape;
use crate::{Cut, MeshError, Slit, TetMesh};

/// What cuts of no width changed in a mesh and its skin.
///
/// Skin triangles of divided tets are replaced by copies, which follow the whole triangles.
#[derive(Debug)]
pub struct Severed {
    /// The vertex of the mesh at the place of each virtual node. These nodes are the last vertices
    /// of the divided mesh.
    pub virtual_nodes: Vec<u32>,
    /// The skin triangles that have copies, in the order of the skin.
    pub triangles: Vec<[u32; 3]>,
    /// The copies of these triangles. Their field `triangle` is a number in `triangles`.
    pub copies: Vec<TriangleCopy>,
    /// The blades of the slits without a width, in their order.
    pub blades: Vec<Blade>,
    /// The shapes of the parts of divided tets. They fill the divided tets.
    pub tet_pieces: Pieces<4>,
    /// The shapes of the copies of skin triangles. Their field `copies` is a number in `copies`.
    pub skin_pieces: Pieces<3>,
    /// What the cuts need to grow, if they do.
    pub growth: Option<Growth>,
}

impl Slit {
    /// The blade of the incision: through the skin along the segment, with stations that are at
    /// most `step` apart. `margin` is that of [`Blade::along`].
    fn blade(&self, step: f64, margin: f64) -> Option<Blade> {
        let count = (self.length() / step).ceil().clamp(1.0, Self::MOST_STATIONS) as usize;
        let station = |n: usize| {
            let along = self.length() * (n as f64 / count as f64);
            Station { skin: self.skin_at(along), inward: self.inward() }
        };
        let stations: Vec<Station> = (0..=count).map(station).collect();
        Blade::along(&stations, self.depth(), self.above(), margin)
    }

    /// Largest number of stations of a blade.
    const MOST_STATIONS: f64 = 1024.0;
}

impl Cut {
    /// Cuts the mesh and its skin along the slits without a width, and adds the gapes of these
    /// slits. Call it after [`Cut::apply`] and once. None if no slit is without a width. With
    /// `grows`, the result can tell the elements of a wound that is not finished.
    ///
    /// # Errors
    /// [`MeshError::IncisionEmpty`] if a slit crosses no edge. [`MeshError::IncisionWithoutLips`]
    /// if it does not cut the skin. [`MeshError::TooManyCuts`] if too many slits meet in one tet.
    pub fn sever(
        &mut self,
        mesh: &mut TetMesh,
        triangles: &mut Vec<[u32; 3]>,
        grows: bool,
    ) -> Result<Option<Severed>, MeshError> {
        let severing_slits: Vec<usize> =
            (0..self.slits.len()).filter(|&n| self.slits[n].removes_nothing()).collect();
        if severing_slits.is_empty() {
            return Ok(None);
        }
        let mut severing = Severing::new(mesh);
        let mut blades = Vec::new();
        let step_mm = mesh.lattice.longest_step_mm();
        let step = step_mm / 1000.0;
        for &incision in &severing_slits {
            let blade = self.slits[incision].blade(step / 2.0, 2.0 * longest_edge(mesh));
            let crossing = blade.map(|blade| (severing.add(mesh, &blade).1, blade));
            match crossing {
                Some((crossed, blade)) if crossed > 0 => blades.push(blade),
                _ => return Err(MeshError::IncisionEmpty { incision, step_mm }),
            }
        }
        let (wound, growth) = if grows {
            severing.grow(mesh, triangles).map(|(wound, growth)| (wound, Some(growth)))
        } else {
            severing.cut_all();
            severing.wound(mesh).map(|wound| (wound, None))
        }
        .map_err(|error| MeshError::TooManyCuts {
            cuts: error.blades,
            at_mm: mesh.frame.to_mm(mesh.positions[mesh.tets[error.tet as usize][0] as usize]).into(),
        })?;
        let mut copies = wound.skin(mesh, triangles);
        let skin_pieces = wound.skin_pieces(mesh, triangles, &copies);
        let rest = [mesh.positions.as_slice(), &wound.positions(mesh)].concat();
        for (blade, &incision) in severing_slits.iter().enumerate() {
            let lips = wound.lips(mesh, triangles, &copies, blade);
            let gape = Gape::of_lips(&rest, incision, &self.slits[incision], &lips, step)?;
            self.gapes.insert(incision, gape);
        }
        let tet_pieces = wound.tet_pieces(mesh);
        mesh.divide(&wound);
        self.removed.resize(mesh.positions.len(), false);
        if !grows {
            // A vertex that a blade touches may lose all its tets.
            let mut held = vec![false; mesh.positions.len()];
            mesh.tets.iter().flatten().for_each(|&v| held[v as usize] = true);
            self.removed.iter_mut().zip(held).for_each(|(removed, held)| *removed |= !held);
        }
        let mut replaced: Vec<u32> = copies.iter().map(|copy| copy.triangle).collect();
        replaced.dedup();
        for copy in &mut copies {
            copy.triangle = replaced.partition_point(|&number| number < copy.triangle) as u32;
        }
        let skin = std::mem::take(triangles);
        let (divided, whole): (Vec<_>, Vec<_>) =
            (0..).zip(skin).partition(|(number, _)| replaced.binary_search(number).is_ok());
        triangles.extend(whole.into_iter().map(|(_, triangle)| triangle));
        triangles.extend(copies.iter().map(|copy| copy.nodes));
        let divided = divided.into_iter().map(|(_, triangle)| triangle).collect();
        let virtual_nodes = wound.virtual_nodes;
        Ok(Some(Severed {
            virtual_nodes,
            triangles: divided,
            copies,
            blades,
            tet_pieces,
            skin_pieces,
            growth,
        }))
    }
}
