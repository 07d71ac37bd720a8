//! The deformation of a body in the form that the resampler needs, and volumes through it.

use std::borrow::Cow;

use cutis_resample::{ResampleReport, Warp, blend_walls};
use cutis_volume::Volume;
use nalgebra::Point3;

use super::report::Resample;
use super::warp_mesh::WarpMesh;
use crate::backend::{DevicePositions, Stages};
use crate::body::Body;
use crate::{Error, Progress};

/// The deformation of a body, with the shell of partly empty tetrahedra that follows its surface.
pub(crate) struct BodyWarp {
    mesh: WarpMesh,
    deformed: Vec<Point3<f32>>,
    /// The deformed positions of mesh and shell on the GPU, if the simulation left the positions of
    /// the mesh there.
    on_device: Option<DevicePositions>,
}

impl BodyWarp {
    /// Prepares the deformation to these positions, one per mesh vertex, in local meters. `time_s`
    /// is when the last cuts were made: a piece that is taken out later is part of the body.
    /// `on_device` are the same positions on the GPU of the stages.
    ///
    /// # Errors
    /// The errors of [`WarpMesh::new`].
    pub(crate) fn new(
        body: &Body,
        deformed: &[Point3<f32>],
        time_s: f64,
        on_device: Option<&DevicePositions>,
        stages: &Stages,
    ) -> Result<Self, Error> {
        let mesh = WarpMesh::new(body, time_s)?;
        let moved = mesh.further(deformed);
        Ok(Self {
            mesh,
            on_device: on_device.and_then(|positions| stages.append(positions, &moved)),
            deformed: [deformed, &moved].concat(),
        })
    }

    /// The deformation for the resampler.
    pub(super) fn warp(&self) -> Warp<'_> {
        self.mesh.warp(&self.deformed)
    }

    /// Two opposite corners of a box in mm, along the axes of the patient, that holds all walls of
    /// wounds at rest and deformed. `None` without a wound.
    pub(crate) fn walls_mm(&self) -> Option<[Point3<f64>; 2]> {
        let WarpMesh { origin_mm, rest, tets, removed, at_walls, .. } = &self.mesh;
        let at_walls = at_walls.iter().map(|&tet| &tets[tet as usize]);
        let nodes = at_walls.chain(removed).flatten().map(|&v| v as usize);
        let mut points = nodes.flat_map(|v| [rest[v], self.deformed[v]]);
        let first = points.next()?;
        let (low, high) = points.fold((first, first), |(low, high), p| (low.inf(&p), high.sup(&p)));
        Some([low, high].map(|corner| origin_mm + corner.coords.cast::<f64>() * 1000.0))
    }

    /// Resamples a volume through the deformation. A voxel that the wall of a wound crosses takes
    /// the mean over the voxel, as in a scan.
    ///
    /// # Errors
    /// The errors of the resampler.
    pub(crate) fn apply(
        &self,
        volume: &Volume,
        stages: &mut Stages,
        progress: &dyn Progress,
    ) -> Result<(Volume, Resample), Error> {
        let resampled = self.apply_to_centers(volume, stages, progress)?;
        self.with_walls(volume, resampled)
    }

    /// As [`BodyWarp::apply`], for the parts of the volume that `is_needed` names: it receives the
    /// middle of a part in world mm, and the radius in mm of a ball around it. On a GPU all parts
    /// are resampled, and on a CPU the others keep their values.
    ///
    /// # Errors
    /// The errors of the resampler.
    pub(super) fn apply_where(
        &self,
        volume: &Volume,
        is_needed: &dyn Fn(Point3<f64>, f64) -> bool,
        stages: &mut Stages,
        progress: &dyn Progress,
    ) -> Result<(Volume, Resample), Error> {
        let (warp, on_device) = (self.mesh.warp(&self.deformed), self.on_device.as_ref());
        let progress = |done: usize, total: usize| progress.advance_of(done as u64, total as u64);
        let (resampled, report) = stages.resample_where(volume, &warp, on_device, is_needed, &progress)?;
        self.with_walls(volume, (resampled, counts(report)))
    }

    /// A resampled volume in which voxels that the wall of a wound crosses have the mean over the
    /// voxel.
    fn with_walls(
        &self,
        volume: &Volume,
        (resampled, report): (Volume, Resample),
    ) -> Result<(Volume, Resample), Error> {
        let warp = self.mesh.warp(&self.deformed);
        Ok((blend_walls(volume, &warp, &self.mesh.at_walls, resampled)?.0, report))
    }

    /// Resamples a volume through the deformation. Each voxel takes the value at its center.
    ///
    /// # Errors
    /// The errors of the resampler.
    pub(crate) fn apply_to_centers(
        &self,
        volume: &Volume,
        stages: &mut Stages,
        progress: &dyn Progress,
    ) -> Result<(Volume, Resample), Error> {
        let (volume, report) = stages.resample(
            volume,
            &self.mesh.warp(&self.deformed),
            self.on_device.as_ref(),
            &|done, total| progress.advance_of(done as u64, total as u64),
        )?;
        Ok((volume, counts(report)))
    }

    /// The volume before the first frame: with the cuts from the start, and nothing moved. Voxels
    /// outside the removed tetrahedra keep their values, so only the tetrahedra around them take
    /// part.
    ///
    /// # Errors
    /// The errors of the resampler.
    pub(crate) fn cut_at_rest<'v>(
        &self,
        volume: &'v Volume,
        stages: &mut Stages,
        progress: &dyn Progress,
    ) -> Result<Cow<'v, Volume>, Error> {
        let WarpMesh { rest, tets, body_tets, removed, removed_at_start, .. } = &self.mesh;
        let (removed, later) = removed.split_at(*removed_at_start);
        if removed.is_empty() {
            return Ok(Cow::Borrowed(volume));
        }
        let mut touched = vec![false; rest.len()];
        removed.iter().flatten().for_each(|&v| touched[v as usize] = true);
        let touches = |tet: &&[u32; 4]| tet.iter().any(|&v| touched[v as usize]);
        let around = |tets: &[[u32; 4]]| -> Vec<[u32; 4]> { tets.iter().filter(touches).copied().collect() };
        let (body, shell) = tets.split_at(*body_tets);
        let (body, shell) = (around(body), around(shell));
        let tets = [body.as_slice(), &shell, &around(later)].concat();
        let warp = Warp { tets: &tets, body_tets: body.len(), removed, ..self.mesh.warp(rest) };
        let progress = |done: usize, total: usize| progress.advance_of(done as u64, total as u64);
        Ok(Cow::Owned(stages.resample(volume, &warp, None, &progress)?.0))
    }
}

/// The counts for the report.
fn counts(report: ResampleReport) -> Resample {
    Resample {
        moved_voxels: report.moved_voxels as u64,
        folds: report.folds as u64,
        vacated_voxels: report.vacated_voxels as u64,
    }
}
