//! The stitches of the sutures of a scene.

use cutis_mesh::{Cut, MeshError, Stitch, Stitching, TetMesh};

use super::BodySections;
use crate::Error;
use crate::scene::SutureSection;

/// The stitches of each suture of the scene.
///
/// # Errors
/// [`Error`] for a suture that has no tissue at one of its ends.
pub(super) fn stitches(
    sections: &BodySections<'_>,
    mesh: &TetMesh,
    cut: &Cut,
    skin: &[[u32; 3]],
) -> Result<Vec<Vec<Stitch>>, Error> {
    let place = |(n, (suture, &wound)): (usize, (&SutureSection, &usize))| {
        let (bite, depth) = (suture.bite_mm / 1000.0, suture.depth_mm / 1000.0);
        let along = |every_mm: f64| Stitching { every: every_mm / 1000.0, bite, depth };
        let placed = match (suture.every_mm, wound.checked_sub(sections.incisions.len())) {
            (None, _) => cut.stitches_between(&suture.pairs_mm, mesh, skin, 2.0 * bite),
            (Some(every), None) => cut.stitches(wound, mesh, skin, &along(every)),
            (Some(every), Some(excision)) => cut.stitches_across(excision, mesh, skin, &along(every)),
        };
        let section = format!("suture[{n}]");
        placed.map_err(|error| match error {
            MeshError::Excision { why, .. } => sections.file.bad_key(&section, "", &why),
            other => sections.file.blame(&section)(other),
        })
    };
    sections.sutures.iter().zip(&sections.closes).enumerate().map(place).collect()
}
