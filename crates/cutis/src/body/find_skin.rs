//! `cutis skin`: the skin of a volume, without a scene.

use std::path::Path;

use cutis_mesh::vtk::{self, Cells, Piece, Space};
use cutis_mesh::{Frame, Lattice, Skin, SkinMode, SkinOptions, SkinReport, Split, skin};
use cutis_volume::sample::LatticeSize;
use cutis_volume::{Table, TableKind, nifti, sample};
use nalgebra::Point3;

use crate::{Error, Progress};

/// What to look for, and on which lattice.
#[derive(Clone, Copy, Debug)]
pub struct SkinRequest {
    /// Lattice over the volume.
    pub lattice: LatticeSize,
    /// How a cell is split.
    pub split: Split,
    /// Detection rule.
    pub mode: SkinMode,
}

/// Detects the skin of a volume file and, if `out` is given, writes its triangles (`.vtu` or `.vtp`).
///
/// # Errors
/// [`Error`] for a volume that cannot be read, a lattice that does not fit, or a file that cannot be written.
pub fn find_skin(
    volume: &Path,
    request: &SkinRequest,
    out: Option<&Path>,
    progress: &dyn Progress,
) -> Result<SkinReport, Error> {
    if let Some(path) = out {
        check_extension(path)?;
    }
    progress.begin("read the CT", 0);
    let volume = nifti::read(volume)?.volume;
    progress.end();
    progress.begin("detect the skin", 0);
    let lattice = Lattice::new(sample::lattice_grid(volume.grid(), request.lattice)?, request.split)?;
    let alpha = Table::preset(TableKind::Alpha, "paper")?;
    let hu = sample::to_grid(&volume, lattice.grid())?;
    let air: Vec<bool> = hu.iter().map(|&hu| alpha.is_air(hu)).collect();
    let found = skin::detect(&lattice, &air, request.mode, &SkinOptions::default())?;
    progress.end();
    if let Some(path) = out {
        write(path, &lattice, &found)?;
    }
    Ok(found.report)
}

fn check_extension(path: &Path) -> Result<(), Error> {
    match path.extension().and_then(|e| e.to_str()) {
        Some("vtu" | "vtp") => Ok(()),
        _ => Err(Error::Request {
            what: format!("--out {}", path.display()),
            why: "must end in .vtu or .vtp".into(),
        }),
    }
}

/// Numbers the points in use and writes them.
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
    let piece =
        Piece { frame: &frame, positions: &positions, cells: Cells::Triangles(&triangles), data: &[] };
    if path.extension().is_some_and(|e| e == "vtp") {
        vtk::write_vtp(path, Space::default(), &piece)?;
    } else {
        vtk::write_vtu(path, Space::default(), &piece)?;
    }
    Ok(())
}
