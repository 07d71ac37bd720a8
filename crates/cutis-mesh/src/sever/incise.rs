//! Incisions of no width on a mesh with its skin.

use super::blade::Blade;
use super::growth::Growth;
use super::lip_pairs::LipPair;
use super::pieces::Pieces;
use super::severing::{Severing, longest_edge};
use super::stations::stations;
use super::wound::{TooManyBlades, TriangleCopy, Wound};
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
    /// The blades: those of the incisions without a width, of pockets, and of pieces.
    pub blades: Vec<Blade>,
    /// The pairs of points on both sides of the finished cuts.
    pub lip_pairs: Vec<LipPair>,
    /// The shapes of the parts of divided tets. They fill the divided tets, but for those that are
    /// taken out.
    pub tet_pieces: Pieces<4>,
    /// For each blade: the shapes of the parts of tets that it takes out with a piece, with the
    /// corners of `tet_pieces`.
    pub taken_out: Vec<Vec<[u32; 4]>>,
    /// The shapes of the copies of skin triangles. Their field `copies` is a number in `copies`.
    pub skin_pieces: Pieces<3>,
}

/// The blade of an incision: through the skin along its segments, with stations that are at most
/// `step` apart. `margin` is that of [`Blade::along`].
fn blade(slits: &[Slit], step: f64, margin: f64) -> Option<Blade> {
    let path: Vec<&Slit> = slits.iter().collect();
    let above = slits.iter().map(Slit::above).fold(0.0, f64::max);
    Blade::along(&stations(&path, step, false)?, slits[0].depth(), above, margin)
}

/// Cuts a mesh with this skin, whose blades have been added, and returns the finished wound.
type CutAll<G> = fn(&mut Severing, &TetMesh, &[[u32; 3]]) -> Result<(Wound, G), TooManyBlades>;

impl Cut {
    /// Cuts the mesh and its skin along the incisions without a width, and adds their gapes. Call
    /// it after [`Cut::apply`] and once. None if no incision is without a width.
    ///
    /// # Errors
    /// [`MeshError::IncisionEmpty`] if an incision crosses no edge.
    /// [`MeshError::IncisionWithoutLips`] if it does not cut the skin. [`MeshError::TooManyCuts`]
    /// if too many incisions meet in one tet.
    pub fn sever(
        &mut self,
        mesh: &mut TetMesh,
        triangles: &mut Vec<[u32; 3]>,
    ) -> Result<Option<Severed>, MeshError> {
        let severed = self.sever_with(mesh, triangles, |severing, mesh, _| {
            severing.cut_all();
            let wound = severing.wound(mesh)?;
            let pairs = severing.lip_pairs(mesh, &wound);
            Ok((wound, pairs))
        })?;
        let Some((mut severed, lip_pairs)) = severed else { return Ok(None) };
        severed.lip_pairs = lip_pairs;
        // A vertex that a blade touches may lose all its tets.
        let mut held = vec![false; mesh.positions.len()];
        mesh.tets.iter().flatten().for_each(|&v| held[v as usize] = true);
        self.removed.iter_mut().zip(held).for_each(|(removed, held)| *removed |= !held);
        Ok(Some(severed))
    }

    /// Does what [`Cut::sever`] does, and returns how the cuts grow to that. No vertex counts as
    /// removed.
    ///
    /// # Errors
    /// The errors of [`Cut::sever`].
    pub fn sever_growing(
        &mut self,
        mesh: &mut TetMesh,
        triangles: &mut Vec<[u32; 3]>,
    ) -> Result<Option<(Severed, Growth)>, MeshError> {
        let mut severed = self.sever_with(mesh, triangles, Severing::grow)?;
        if let Some((severed, growth)) = &mut severed {
            severed.lip_pairs = growth.lip_pairs(&growth.lengths());
        }
        Ok(severed)
    }

    fn sever_with<G>(
        &mut self,
        mesh: &mut TetMesh,
        triangles: &mut Vec<[u32; 3]>,
        cut: CutAll<G>,
    ) -> Result<Option<(Severed, G)>, MeshError> {
        let cuts: Vec<(usize, &[Slit])> =
            self.incisions().enumerate().filter(|(_, slits)| slits[0].removes_nothing()).collect();
        if cuts.is_empty() && self.pockets.is_empty() && self.pieces.is_empty() {
            return Ok(None);
        }
        let mut severing = Severing::new(mesh);
        let mut blades = Vec::new();
        let step_mm = mesh.lattice.longest_step_mm();
        let step = step_mm / 1000.0;
        for &(incision, slits) in &cuts {
            let blade = blade(slits, step / 2.0, 2.0 * longest_edge(&mesh.lattice));
            let crossing = blade.map(|blade| (severing.add(mesh, &blade).1, blade));
            match crossing {
                Some((crossed, blade)) if crossed > 0 => blades.push(blade),
                _ => return Err(MeshError::IncisionEmpty { incision, step_mm }),
            }
        }
        for (number, pocket) in self.pockets.iter().enumerate() {
            if severing.add(mesh, &pocket.blade).1 == 0 {
                let why = format!("it crosses no edge of the lattice, whose step is {step_mm:.1} mm");
                return Err(MeshError::Undermining { undermining: number, why });
            }
            blades.push(pocket.blade.clone());
        }
        let first_piece = blades.len();
        for (number, piece) in self.pieces.iter().enumerate() {
            if piece.blades.iter().map(|blade| severing.add(mesh, blade).1).sum::<usize>() == 0 {
                let why = format!("it crosses no edge of the lattice, whose step is {step_mm:.1} mm");
                return Err(MeshError::Excision { excision: number, why });
            }
            blades.extend(piece.blades.clone());
        }
        let (wound, growth) =
            cut(&mut severing, mesh, triangles).map_err(|error| MeshError::TooManyCuts {
                cuts: error.blades,
                at_mm: mesh.frame.to_mm(mesh.positions[mesh.tets[error.tet as usize][0] as usize]).into(),
            })?;
        let mut copies = wound.skin(mesh, triangles);
        let skin_pieces = wound.skin_pieces(mesh, triangles, &copies);
        let rest = [mesh.positions.as_slice(), &wound.positions(mesh)].concat();
        let mut gapes = Vec::new();
        for (blade, &(incision, slits)) in cuts.iter().enumerate() {
            let lips = wound.lips(mesh, triangles, &copies, blade);
            gapes.push((incision, Gape::of_lips(&rest, slits, &lips, step)?));
        }
        gapes.into_iter().for_each(|(incision, gape)| self.gapes.insert(incision, gape));
        for (number, piece) in self.pieces.iter().enumerate() {
            let of_blade = |side| wound.lips(mesh, triangles, &copies, first_piece + 2 * number + side);
            let lips = [of_blade(0), of_blade(1)].concat();
            let gape =
                Gape::of_outline(&rest, &piece.axis, &lips, step).map_err(|_| MeshError::Excision {
                    excision: number,
                    why: "it leaves no skin on both sides of its long axis".to_owned(),
                })?;
            self.gapes.push(gape);
        }
        let (tet_pieces, taken_out) = wound.tet_pieces(mesh, blades.len());
        let replaced: Vec<u32> =
            wound.areas(mesh, triangles).into_iter().map(|triangle| triangle.triangle).collect();
        mesh.divide(&wound);
        self.removed.resize(mesh.positions.len(), false);
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
        let lip_pairs = Vec::new();
        let severed = Severed {
            virtual_nodes,
            triangles: divided,
            copies,
            blades,
            lip_pairs,
            tet_pieces,
            taken_out,
            skin_pieces,
        };
        Ok(Some((severed, growth)))
    }
}
