//! `cutis skin`: finds the skin of a volume without a scene.

use std::path::Path;

use cutis_mesh::vtk::{self, Cells, Piece, Space};
use cutis_mesh::{
    Frame, Lattice, Skin, SkinMode, SkinOptions, SkinReport, Split, Surface, skin, write_ply, write_stl,
};
use cutis_volume::sample::LatticeSize;
use cutis_volume::{ReadOptions, sample};
use nalgebra::Point3;

use super::{AIR_BELOW_HU, air, memory, no_skin};
use crate::ct::source::with_offset;
use crate::{Error, Progress};

/// The rule by which the skin is found, and the lattice.
#[derive(Clone, Copy, Debug)]
pub struct SkinRequest {
    /// How the volume is read.
    pub read: ReadOptions,
    /// Lattice over the volume.
    pub lattice: LatticeSize,
    /// How a cell is split into tetrahedra.
    pub split: Split,
    /// Rule by which skin triangles are chosen.
    pub mode: SkinMode,
    /// HU that are added to every value of the file, as `volume.offset_hu` of a scene.
    pub offset_hu: f32,
}

/// Finds the skin of a volume file. If `out` is given, writes its triangles (`.vtu`,
/// `.vtp`, `.ply` or `.stl`).
///
/// # Errors
/// [`Error`] for a volume that cannot be read or has no skin, a lattice that does not fit, or a
/// file that cannot be written.
pub fn find_skin(
    volume: &Path,
    request: &SkinRequest,
    out: Option<&Path>,
    progress: &dyn Progress,
) -> Result<SkinReport, Error> {
    if let Some(path) = out {
        check_extension(path)?;
    }
    let named = volume;
    progress.begin("read the CT", 0);
    let volume = cutis_volume::read(volume, &request.read)?.volume;
    progress.end();
    let no_skin = |why| Error::NoSkin { ct: named.into(), why };
    let volume = with_offset(volume, request.offset_hu)?;
    no_skin::refuse_offset(&volume, AIR_BELOW_HU, "--offset-hu").map_err(no_skin)?;
    progress.begin("detect the skin", 0);
    let lattice = Lattice::new(sample::lattice_grid(volume.grid(), request.lattice)?, request.split)?;
    memory::check_request(lattice.grid().len())?;
    let air = air(&sample::to_grid(&volume, lattice.grid())?, AIR_BELOW_HU);
    let found = skin::detect(&lattice, &air, request.mode, &SkinOptions::default())?;
    progress.end();
    if found.triangles.is_empty() {
        return Err(no_skin(no_skin::reason(&volume, AIR_BELOW_HU, &found.report)));
    }
    if let Some(path) = out {
        write(path, &lattice, &found)?;
    }
    Ok(found.report)
}

fn check_extension(path: &Path) -> Result<(), Error> {
    match path.extension().and_then(|e| e.to_str()) {
        Some("vtu" | "vtp" | "ply" | "stl") => Ok(()),
        _ => Err(Error::Request {
            what: format!("--out {}", path.display()),
            why: "must end in .vtu, .vtp, .ply or .stl".into(),
        }),
    }
}

/// Renumbers the points that triangles use, and writes points and triangles.
fn write(path: &Path, lattice: &Lattice, skin: &Skin) -> Result<(), Error> {
    let grid = lattice.grid();
    let frame = Frame::center_of(grid);
    let mut used: Vec<u32> = skin.triangles.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    let positions: Vec<Point3<f32>> =
        used.iter().map(|&point| frame.to_local(grid.mm(grid.point(point as usize)))).collect();
    let number = |point: u32| used.partition_point(|&other| other < point) as u32;
    let triangles: Vec<[u32; 3]> = skin.triangles.iter().map(|triangle| triangle.map(number)).collect();
    let cells = Cells::Triangles(&triangles);
    let piece = Piece { frame: &frame, positions: &positions, cells, data: &[], cell_data: &[] };
    let surface = Surface { frame: &frame, positions: &positions, triangles: &triangles };
    let space = Space::default();
    Ok(match path.extension().and_then(|extension| extension.to_str()) {
        Some("vtp") => vtk::write_vtp(path, space, &piece),
        Some("ply") => write_ply(path, space, &surface),
        Some("stl") => write_stl(path, space, &surface),
        _ => vtk::write_vtu(path, space, &piece),
    }?)
}

#[cfg(test)]
mod tests {
    use cutis_volume::{Table, TableKind};

    use super::*;

    /// The paper's table of opacity and the default of a scene agree on air, so there is one
    /// definition.
    #[test]
    fn air_is_below_the_foot_of_the_opacity_ramp() {
        let opacity = Table::preset(TableKind::Alpha, "paper").unwrap();
        let hu = [-3024.0, -1000.0, -449.1, -449.0, -448.9, 0.0, 3000.0];
        assert_eq!(air(&hu, AIR_BELOW_HU), hu.map(|hu| opacity.is_air(hu)));
    }
}
