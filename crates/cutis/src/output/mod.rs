//! What a run leaves behind: the deformed CT, surfaces, pictures. Nothing is computed for an output that is not named.

pub(crate) mod html;
pub(crate) mod pictures;
pub mod report;

use std::path::{Path, PathBuf};

use cutis_mesh::Shell;
use cutis_mesh::vtk::{self, Cells, Piece, PointData, PointValues, Space};
use cutis_render::plot::{Axis, Mark, Scale, Series, line_chart};
use cutis_resample::Warp;
use cutis_volume::{Volume, nifti};
use nalgebra::Point3;

use crate::backend::{Request, Stages};
use crate::body::Body;
use crate::ct::source::{self, Source};
use crate::report::{Report, Resample};
use crate::run::checkpoint::{self, Checkpoint};
use crate::run::clock::Clock;
use crate::run::files;
use crate::run::files::RunFolder;
use crate::run::frames::FrameRow;
use crate::scene::LoadedScene;
use crate::{Error, Progress};
use html::Figure;

/// The end of a simulation.
pub(crate) struct Outcome<'a> {
    pub(crate) loaded: &'a LoadedScene,
    pub(crate) source: &'a Source,
    pub(crate) body: &'a Body,
    /// Local meters, one per mesh vertex.
    pub(crate) deformed: &'a [Point3<f32>],
    pub(crate) folder: &'a RunFolder,
}

/// What the outputs tell the report.
#[derive(Default)]
pub(crate) struct Products {
    pub(crate) resample: Option<Resample>,
    pub(crate) figures: Vec<Figure>,
    pub(crate) warnings: Vec<String>,
}

/// Writes the outputs that the scene names.
pub(crate) fn write(
    outcome: &Outcome<'_>,
    stages: &mut Stages,
    clock: &mut Clock<'_>,
) -> Result<Products, Error> {
    let Outcome { loaded, source, body, deformed, folder } = outcome;
    let output = &loaded.scene.output;
    let mut products = Products::default();
    if output.surface {
        clock.stage("write skin.vtu", 0, |_| {
            // With the skin that a region left out, which lies where it was.
            let (now, triangles) = body.whole_skin(deformed);
            let (rest, _) = body.whole_skin(&body.mesh.positions);
            let hu = [body.mesh.hu.as_slice(), &body.inactive_hu].concat();
            write_mesh(&folder.skin(), body, [&rest, &now], &hu, Cells::Triangles(&triangles))
        })?;
    }
    if output.tissue {
        clock.stage("write tissue.vtu", 0, |_| {
            let mesh = &body.mesh;
            let positions = [mesh.positions.as_slice(), deformed];
            write_mesh(&folder.tissue(), body, positions, &mesh.hu, Cells::Tets(&mesh.tets))
        })?;
    }
    if !(output.volume || output.pictures) {
        return Ok(products);
    }
    let warp = BodyWarp::new(body, deformed)?;
    let (volume, found) = clock.stage_placed("resample the CT", 0, |progress| {
        Ok((warp.apply(&source.volume, stages, progress)?, stages.place()))
    })?;
    if found.folds > 0 {
        products
            .warnings
            .push(format!("{} voxels lie in two places of the deformed body at once (folds)", found.folds));
    }
    products.resample = Some(found);
    if output.volume {
        clock.stage("write deformed.nii.gz", 0, |_| Ok(nifti::write(folder.volume(), &volume)?))?;
    }
    if output.pictures {
        let figures = clock.stage_placed("pictures", 0, |progress| {
            let rest = BodyWarp::new(body, &body.mesh.positions)?;
            let (at_rest, _) = rest.apply(&source.volume, stages, progress)?;
            let depth = pictures::depth(&source.volume, &loaded.scene)?;
            let depth_after = warp.apply(&depth, stages, progress)?.0;
            let [before, after] = [(&at_rest, &depth), (&volume, &depth_after)];
            Ok((pictures::draw(outcome, stages, before, after)?, stages.place()))
        })?;
        for (path, png) in [folder.before(), folder.after(), folder.slice()].iter().zip(&figures) {
            files::write(path, &png.png)?;
        }
        products.figures = figures;
    }
    products.warnings.append(&mut stages.notes);
    Ok(products)
}

/// The body with its shell, as the resampler takes it.
struct BodyWarp<'a> {
    body: &'a Body,
    body_tets: usize,
    tets: Vec<[u32; 4]>,
    rest: Vec<Point3<f32>>,
    deformed: Vec<Point3<f32>>,
    removed: Vec<[u32; 4]>,
}

impl<'a> BodyWarp<'a> {
    fn new(body: &'a Body, deformed: &[Point3<f32>]) -> Result<Self, Error> {
        let mesh = &body.mesh;
        let shell = Shell::new(mesh, &body.air, &body.cut)?;
        let followed = shell.follow(&mesh.positions, deformed);
        Ok(Self {
            body,
            body_tets: mesh.tets.len(),
            tets: [mesh.tets.as_slice(), &shell.tets].concat(),
            rest: [mesh.positions.as_slice(), &shell.positions].concat(),
            deformed: [deformed, &followed].concat(),
            removed: [body.removed.tets.as_slice(), &shell.removed].concat(),
        })
    }

    fn apply(
        &self,
        volume: &Volume,
        stages: &mut Stages,
        progress: &dyn Progress,
    ) -> Result<(Volume, Resample), Error> {
        let warp = Warp {
            origin_mm: self.body.mesh.frame.origin_mm,
            rest: &self.rest,
            deformed: &self.deformed,
            tets: &self.tets,
            body_tets: self.body_tets,
            removed: &self.removed,
        };
        let (volume, report) =
            stages.resample(volume, &warp, &|done, _total| progress.advance(done as u64))?;
        let report = Resample {
            covered_voxels: report.covered_voxels as u64,
            folds: report.folds as u64,
            vacated_voxels: report.vacated_voxels as u64,
        };
        Ok((volume, report))
    }
}

/// `positions`: at rest and now.
fn write_mesh(
    path: &Path,
    body: &Body,
    [rest, now]: [&[Point3<f32>]; 2],
    hu: &[f32],
    cells: Cells<'_>,
) -> Result<(), Error> {
    let moved = |(rest, now): (&Point3<f32>, &Point3<f32>)| ((now - rest) * 1000.0).into();
    let displacement: Vec<[f32; 3]> = rest.iter().zip(now).map(moved).collect();
    let data = [
        PointData { name: "displacement_mm", values: PointValues::Vectors(&displacement) },
        PointData { name: "hu", values: PointValues::Scalars(hu) },
    ];
    let piece = Piece { frame: &body.mesh.frame, positions: now, cells, data: &data };
    Ok(vtk::write_vtu(path, Space::default(), &piece)?)
}

/// Writes `report.html`.
pub(crate) fn write_html(
    report: &Report,
    rows: &[FrameRow],
    products: &Products,
    folder: &RunFolder,
) -> Result<(), Error> {
    let wounds = rows.first().map_or(0, |row| row.gapes.len());
    let mut plots = Vec::new();
    if wounds > 0 && rows.len() > 1 {
        let curves: Vec<(String, Vec<[f64; 2]>)> = (0..wounds)
            .flat_map(|n| {
                let name =
                    |what: &str| if wounds == 1 { what.into() } else { format!("wound {} {what}", n + 1) };
                let mean = rows.iter().map(|row| [row.time_s, row.gapes[n].mean_mm]).collect();
                let middle = rows.iter().map(|row| [row.time_s, row.gapes[n].mid_mm]).collect();
                [(name("mean"), mean), (name("in the middle"), middle)]
            })
            .collect();
        let series: Vec<Series<'_>> =
            curves.iter().map(|(name, points)| Series { name, points, mark: Mark::Line }).collect();
        let axis = |label| Axis { label, scale: Scale::Linear };
        plots.push(line_chart(
            "Opening of the wound",
            axis("time / s"),
            axis("distance of the lips / mm"),
            &series,
        ));
    }
    let scene = toml::to_string_pretty(&report.scene).unwrap_or_else(|e| e.to_string());
    files::write(&folder.html(), html::page(report, &products.figures, &plots, &scene).as_bytes())
}

/// What `cutis resample` does: another volume through the deformation of a finished run.
#[derive(Clone, Debug)]
pub struct ResampleRequest {
    /// Run folder with a checkpoint.
    pub run: PathBuf,
    /// Volume to deform; none: the scene's own.
    pub volume: Option<PathBuf>,
    /// File to write.
    pub out: PathBuf,
}

/// Carries a volume through the deformation of a finished run.
///
/// # Errors
/// [`Error::Checkpoint`] if the run's checkpoint is not of this scene; other [`Error`]s as for a run.
pub fn resample_run(
    loaded: &LoadedScene,
    request: &ResampleRequest,
    progress: &dyn Progress,
) -> Result<Resample, Error> {
    let mut clock = Clock::new(progress);
    let folder = RunFolder(request.run.clone());
    let mut stages = Stages::on(Request::of(loaded)?.open()?);
    let source = clock.stage("read the CT", 0, |_| source::load(loaded))?;
    let body = clock.stage("lattice, skin, incision", 0, |_| Body::build(loaded, &source.volume))?;
    let fingerprint = checkpoint::fingerprint(&loaded.scene, &source.sha256);
    let saved = Checkpoint::read(&folder.checkpoint(), &fingerprint, body.mesh.positions.len())?;
    let volume = match &request.volume {
        Some(path) => nifti::read(path)?.volume,
        None => source.volume,
    };
    let warp = BodyWarp::new(&body, &saved.positions)?;
    let (deformed, report) =
        clock.stage("resample", 0, |progress| warp.apply(&volume, &mut stages, progress))?;
    stages.notes.iter().for_each(|note| progress.note(note));
    clock.stage("write", 0, |_| Ok(nifti::write(&request.out, &deformed)?))?;
    Ok(report)
}
