//! The elements on which constraints act: all of a body, or those that a growing cut changes apart
//! from the others.

use cutis_mesh::TetMesh;
use cutis_mesh::sever::{LipPair, Stage, TriangleCopy};

use crate::body::Body;

/// Elements of a body, with vertices of its mesh.
pub(crate) enum Elements<'a> {
    /// All elements.
    All(&'a Body),
    /// The elements that no growing cut changes.
    Whole(&'a Body),
    /// The elements along growing cuts, at a stage.
    Wound(&'a WoundElements),
}

/// The elements along growing cuts at a stage.
pub(crate) struct WoundElements {
    edges: Vec<[u32; 2]>,
    edge_volumes: Vec<f32>,
    edge_colors: Vec<u16>,
    tets: Vec<[u32; 4]>,
    tet_volumes: Vec<f32>,
    tet_colors: Vec<u16>,
    /// Triangles that are not divided yet, then the copies of the others.
    skin: Vec<[u32; 3]>,
    /// The triangles that are divided at this stage.
    divided: Vec<[u32; 3]>,
    /// Shares of the area of the copies.
    shares: Vec<f32>,
    /// Pairs of points on both sides of the cuts, if their contact acts.
    lip_pairs: Vec<LipPair>,
}

/// Skin triangles that a cut of no width divides.
pub(crate) struct DividedSkin<'a> {
    /// The triangles in the scan.
    pub(crate) triangles: &'a [[u32; 3]],
    /// The triangles that replace them, with the shares of their area.
    pub(crate) copies: &'a [[u32; 3]],
    pub(crate) shares: Vec<f32>,
}

impl WoundElements {
    /// The elements of a stage. `triangles` are the skin triangles that the finished cuts divide.
    pub(crate) fn new(
        mesh: &TetMesh,
        triangles: &[[u32; 3]],
        stage: &Stage,
        lip_pairs: Vec<LipPair>,
    ) -> Self {
        let (uncut, copies): (Vec<&TriangleCopy>, Vec<_>) =
            stage.triangles.iter().partition(|copy| copy.part.is_none() && copy.share == 1.0);
        let mut divided: Vec<u32> = copies.iter().map(|copy| copy.triangle).collect();
        divided.dedup();
        Self {
            edges: stage.edges.iter().map(|edge| edge.nodes).collect(),
            edge_volumes: stage.edges.iter().map(|edge| edge.volume).collect(),
            edge_colors: stage.edges.iter().map(|edge| mesh.edge_color(edge.nodes, edge.number)).collect(),
            tets: stage.tets.iter().map(|tet| tet.nodes).collect(),
            tet_volumes: stage.tets.iter().map(|tet| mesh.copy_volume(tet) as f32).collect(),
            tet_colors: stage.tets.iter().map(|tet| mesh.tet_color(&tet.nodes, tet.number)).collect(),
            skin: uncut.iter().chain(&copies).map(|copy| copy.nodes).collect(),
            divided: divided.into_iter().map(|number| triangles[number as usize]).collect(),
            shares: copies.iter().map(|copy| copy.share).collect(),
            lip_pairs,
        }
    }
}

impl<'a> Elements<'a> {
    pub(crate) fn edges(&self) -> &'a [[u32; 2]] {
        match *self {
            Self::All(body) => &body.mesh.edges,
            Self::Whole(body) => &body.mesh.edges[..body.mesh.whole_edges()],
            Self::Wound(wound) => &wound.edges,
        }
    }

    /// Volume of each edge, m³.
    pub(crate) fn edge_volumes(&self) -> Vec<f32> {
        match self {
            Self::Wound(wound) => wound.edge_volumes.clone(),
            Self::All(body) | Self::Whole(body) => body.mesh.edge_volumes(),
        }
    }

    /// Color of each edge.
    pub(crate) fn edge_colors(&self) -> Vec<u16> {
        match self {
            Self::Wound(wound) => wound.edge_colors.clone(),
            Self::All(body) | Self::Whole(body) => cut_to(body.mesh.edge_colors(), self.edges().len()),
        }
    }

    pub(crate) fn tets(&self) -> &'a [[u32; 4]] {
        match *self {
            Self::All(body) => &body.mesh.tets,
            Self::Whole(body) => &body.mesh.tets[..body.mesh.whole_tets()],
            Self::Wound(wound) => &wound.tets,
        }
    }

    /// Volume of each tet, m³.
    pub(crate) fn tet_volumes(&self) -> Vec<f32> {
        match self {
            Self::Wound(wound) => wound.tet_volumes.clone(),
            Self::All(body) | Self::Whole(body) => body.mesh.tet_volumes(),
        }
    }

    /// Color of each tet.
    pub(crate) fn tet_colors(&self) -> Vec<u16> {
        match self {
            Self::Wound(wound) => wound.tet_colors.clone(),
            Self::All(body) | Self::Whole(body) => cut_to(body.mesh.tet_colors(), self.tets().len()),
        }
    }

    /// The triangles of the skin.
    pub(crate) fn skin(&self) -> &'a [[u32; 3]] {
        match *self {
            Self::All(body) => &body.skin,
            Self::Whole(body) => body.whole_triangles(),
            Self::Wound(wound) => &wound.skin,
        }
    }

    /// Share of its area that a triangle of the skin holds.
    pub(crate) fn skin_share(&self, triangle: usize) -> f64 {
        match self {
            Self::All(body) => body.skin_share(triangle),
            Self::Whole(_) => 1.0,
            Self::Wound(wound) => {
                let uncut = wound.skin.len() - wound.shares.len();
                triangle.checked_sub(uncut).map_or(1.0, |copy| f64::from(wound.shares[copy]))
            }
        }
    }

    /// Pairs of points on both sides of cuts of no width.
    pub(crate) fn lip_pairs(&self) -> &'a [LipPair] {
        match *self {
            Self::All(body) => body.severed.as_ref().map_or(&[], |severed| &severed.lip_pairs),
            Self::Whole(_) => &[],
            Self::Wound(wound) => &wound.lip_pairs,
        }
    }

    /// The triangles of the skin that cuts with a width removed.
    pub(crate) fn removed(&self) -> &'a [[u32; 3]] {
        match *self {
            Self::All(body) | Self::Whole(body) => &body.removed.triangles,
            Self::Wound(_) => &[],
        }
    }

    /// The triangles of the skin that cuts of no width divide; none if there are no such cuts.
    pub(crate) fn divided(&self) -> Option<DividedSkin<'a>> {
        match *self {
            Self::All(body) => body.severed.as_ref().map(|severed| DividedSkin {
                triangles: &severed.triangles,
                copies: &body.skin[body.whole_triangles().len()..],
                shares: severed.copies.iter().map(|copy| copy.share).collect(),
            }),
            Self::Whole(_) => None,
            Self::Wound(wound) => Some(DividedSkin {
                triangles: &wound.divided,
                copies: &wound.skin[wound.skin.len() - wound.shares.len()..],
                shares: wound.shares.clone(),
            }),
        }
    }
}

fn cut_to<T>(mut values: Vec<T>, length: usize) -> Vec<T> {
    values.truncate(length);
    values
}
