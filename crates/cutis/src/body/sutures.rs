//! The stitches of the sutures of a scene.

use cutis_mesh::{Cut, Stitch, TetMesh};

use super::BodySections;
use crate::Error;

/// The stitches of each suture of the scene.
///
/// # Errors
/// [`Error`] for a suture that has no skin at one of its ends.
pub(super) fn stitches(
    sections: &BodySections<'_>,
    mesh: &TetMesh,
    cut: &Cut,
    skin: &[[u32; 3]],
) -> Result<Vec<Vec<Stitch>>, Error> {
    let place = |(n, suture): (usize, &crate::scene::SutureSection)| {
        let [every, bite] = [suture.every_mm, suture.bite_mm].map(|mm| mm / 1000.0);
        let key = format!("suture[{n}]");
        cut.stitches(suture.incision, mesh, skin, every, bite).map_err(sections.file.blame(&key))
    };
    sections.sutures.iter().enumerate().map(place).collect()
}
