//! The files that a run writes: the deformed CT, surfaces, pictures and the report. An output that
//! the scene does not name is not computed.

mod displacement;
pub(crate) mod html;
mod number;
mod pictures;
pub mod report;
mod resample_run;
pub mod rest_report;
mod shown;
mod skin_lines;
mod slices;
mod small_picture;
pub mod step_report;
pub(crate) mod surface;
pub mod suture_report;
mod warp;
pub(crate) mod warp_mesh;
mod wound_place;

use std::path::Path;

use cutis_mesh::vtk::{self, Cells, DataArray, Piece, Space, Values};
use cutis_mesh::{MeshError, Surface, write_ply, write_stl};
use cutis_volume::{Volume, nifti};
use nalgebra::Point3;

use crate::Error;
use crate::backend::{DevicePositions, Stages};
use crate::body::Body;
use crate::run::clock::Clock;
use crate::run::files::{self, RunFolder};
use crate::scene::{OutputSection, Scene};

use displacement::write_field;
use html::Figure;
use pictures::Pictures;
use report::Resample;
use shown::Shown;
use skin_lines::SkinLines;
use slices::SlicePair;
use warp::BodyWarp;
use wound_place::WoundPlace;

pub use displacement::FieldDirection;
pub use resample_run::{ResampleInput, ResampleRequest, resample_run};

/// A deformed body, and the data from which its files are made.
pub(crate) struct DeformedBody<'a> {
    pub(crate) body: &'a Body,
    /// Local meters, one per mesh vertex.
    pub(crate) positions: &'a [Point3<f32>],
    /// The same positions on the GPU, if the simulation left them there.
    pub(crate) on_device: Option<&'a DevicePositions>,
    pub(crate) ct: &'a Volume,
    pub(crate) scene: &'a Scene,
}

/// Results of the outputs for the report.
#[derive(Default)]
pub(crate) struct OutputResults {
    pub(crate) resample: Option<Resample>,
    pub(crate) figures: Vec<Figure>,
    pub(crate) slices: Vec<SlicePair>,
    pub(crate) warnings: Vec<String>,
}

/// Writes the outputs that the section names into the folder.
///
/// # Errors
/// [`Error`] for a file that cannot be written, and for a stage that fails.
pub(crate) fn write(
    deformed: &DeformedBody<'_>,
    output: &OutputSection,
    folder: &RunFolder,
    stages: &mut Stages,
    clock: &mut Clock<'_>,
) -> Result<OutputResults, Error> {
    if output.surface {
        clock.stage("write skin.vtu", 0, |_| write_skin(&folder.skin(), deformed))?;
    }
    for (named, path, write) in
        [(output.ply, folder.ply(), write_ply as SurfaceWriter), (output.stl, folder.stl(), write_stl)]
    {
        if named {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            clock.stage(&format!("write {name}"), 0, |_| write_surface(&path, deformed, write))?;
        }
    }
    if output.tissue {
        clock.stage("write tissue.vtu", 0, |_| write_tissue(&folder.tissue(), deformed))?;
    }
    let mut results = OutputResults::default();
    let resamples = output.volume || output.pictures;
    if !(resamples || output.displacement || output.displacement_forward) {
        return Ok(results);
    }
    let DeformedBody { body, positions, on_device, scene, .. } = *deformed;
    let warp = BodyWarp::new(body, positions, scene.last_frame_s(), on_device, stages)?;
    write_fields(deformed, &warp, output, folder, clock)?;
    if !resamples {
        return Ok(results);
    }
    // Without the volume, only what the pictures show is resampled.
    let shown = match output.volume {
        true => None,
        false => Shown::of(WoundPlace::of(body).as_ref(), deformed.ct.grid().affine.spacing_mm()),
    };
    let (volume, found) = clock.stage_placed("resample the CT", 0, |progress| {
        let resampled = match &shown {
            None => warp.apply(deformed.ct, stages, progress)?,
            Some(shown) => {
                warp.apply_where(deformed.ct, &|mm, radius| shown.shows(mm, radius), stages, progress)?
            }
        };
        Ok((resampled, stages.place()))
    })?;
    if found.folds > 0 {
        let folds = found.folds;
        results.warnings.push(format!(
            "{folds} voxels lie in two places of the deformed body at once (folds): the deformed CT shows one of \
             them. Look at skin.vtu there; less force, or a finer lattice, leaves fewer"
        ));
    }
    // Counts of a part say nothing about the whole.
    results.resample = shown.is_none().then_some(found);
    if output.volume {
        clock.stage("write deformed.nii.gz", 0, |_| Ok(nifti::write(folder.volume(), &volume)?))?;
    }
    if output.pictures {
        let Pictures { figures, slices } = clock.stage_placed("pictures", 0, |progress| {
            Ok((pictures::draw(deformed, &warp, &volume, stages, progress)?, stages.place()))
        })?;
        for figure in &figures {
            files::write(&(figure.path)(folder), &figure.png)?;
        }
        (results.figures, results.slices) = (figures, slices);
    }
    results.warnings.append(&mut stages.notes);
    Ok(results)
}

/// Writes the displacement fields that the section names, on the grid of the CT.
fn write_fields(
    deformed: &DeformedBody<'_>,
    warp: &BodyWarp,
    output: &OutputSection,
    folder: &RunFolder,
    clock: &mut Clock<'_>,
) -> Result<(), Error> {
    let grid = deformed.ct.grid();
    if output.displacement {
        clock.stage("write displacement.nrrd", 0, |progress| {
            let direction = FieldDirection::ToRest;
            let written = write_field(&folder.displacement(), grid, warp, direction, progress)?;
            Ok(written.coverage.write(folder.coverage())?)
        })?;
    }
    if output.displacement_forward {
        clock.stage("write displacement-forward.nrrd", 0, |progress| {
            let path = folder.displacement_forward();
            write_field(&path, grid, warp, FieldDirection::FromRest, progress).map(drop)
        })?;
    }
    Ok(())
}

/// Writes the skin of the whole body, including the inactive skin outside a region of interest. The
/// skin of a membrane also has its lines of tension in the scan.
fn write_skin(path: &Path, deformed: &DeformedBody<'_>) -> Result<(), Error> {
    let body = deformed.body;
    let (now, triangles) = body.whole_skin(deformed.positions);
    let (rest, _) = body.whole_skin(&body.mesh.positions);
    let hu = body.whole_skin_hu();
    let lines = SkinLines::of(body, deformed.scene);
    let cell_data = lines.as_ref().map(SkinLines::arrays).unwrap_or_default();
    write_mesh(path, body, [&rest, &now], &hu, Cells::Triangles(&triangles), &cell_data)
}

/// Writes a surface in one of the formats without data.
type SurfaceWriter = fn(&Path, Space, &Surface<'_>) -> Result<(), MeshError>;

/// Writes the skin of the whole body without data, in the frame of 3D Slicer.
fn write_surface(path: &Path, deformed: &DeformedBody<'_>, write: SurfaceWriter) -> Result<(), Error> {
    let body = deformed.body;
    let (positions, triangles) = body.whole_skin(deformed.positions);
    let surface = Surface { frame: &body.mesh.frame, positions: &positions, triangles: &triangles };
    Ok(write(path, Space::Lps, &surface)?)
}

/// Writes the tetrahedra of the body.
fn write_tissue(path: &Path, deformed: &DeformedBody<'_>) -> Result<(), Error> {
    let body = deformed.body;
    let (now, tets) = body.whole_tissue(deformed.positions);
    let (rest, _) = body.whole_tissue(&body.mesh.positions);
    write_mesh(path, body, [&rest, &now], &body.whole_tissue_hu(), Cells::Tets(&tets), &[])
}

/// Writes cells at their present positions, with the displacement from `rest` and the HU of each
/// vertex.
fn write_mesh(
    path: &Path,
    body: &Body,
    [rest, now]: [&[Point3<f32>]; 2],
    hu: &[f32],
    cells: Cells<'_>,
    cell_data: &[DataArray<'_>],
) -> Result<(), Error> {
    let moved = |(rest, now): (&Point3<f32>, &Point3<f32>)| ((now - rest) * 1000.0).into();
    let displacement: Vec<[f32; 3]> = rest.iter().zip(now).map(moved).collect();
    let data = [
        DataArray { name: "displacement_mm", values: Values::Vectors(&displacement) },
        DataArray { name: "hu", values: Values::Scalars(hu) },
    ];
    let piece = Piece { frame: &body.mesh.frame, positions: now, cells, data: &data, cell_data };
    Ok(vtk::write_vtu(path, Space::default(), &piece)?)
}
