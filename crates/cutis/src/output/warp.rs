//! The deformation of a body in the form that the resampler needs: the mesh and the shell of air
//! around it.

use std::borrow::Cow;

use cutis_mesh::Shell;
use cutis_mesh::sever::Pieces;
use cutis_resample::{Warp, blend_walls};
use cutis_volume::Volume;
use nalgebra::Point3;

use super::report::Resample;
use crate::backend::{DevicePositions, Stages};
use crate::body::Body;
use crate::{Error, Progress};

/// The deformation of a body, with the shell of partly empty tetrahedra that follows its surface.
pub(crate) struct BodyWarp<'a> {
    body: &'a Body,
    body_tets: usize,
    tets: Vec<[u32; 4]>,
    rest: Vec<Point3<f32>>,
    deformed: Vec<Point3<f32>>,
    /// The tetrahedra that incisions removed and those of the pieces that were taken out.
    removed: Vec<[u32; 4]>,
    /// The tets next to the walls of wounds, as indices into `tets`.
    at_walls: Vec<u32>,
    /// Number of `removed` that are missing before the first frame. The others were taken out
    /// later.
    removed_at_start: usize,
    /// The deformed positions of mesh and shell on the GPU, if the simulation left the positions of
    /// the mesh there.
    on_device: Option<DevicePositions>,
}

impl<'a> BodyWarp<'a> {
    /// Prepares the deformation to these positions, one per mesh vertex, in local meters. `time_s`
    /// is when the last cuts were made: a piece that is taken out later is part of the body.
    /// `on_device` are the same positions on the GPU of the stages.
    ///
    /// # Errors
    /// The errors of [`Shell::new`].
    pub(crate) fn new(
        body: &'a Body,
        deformed: &[Point3<f32>],
        time_s: f64,
        on_device: Option<&DevicePositions>,
        stages: &Stages,
    ) -> Result<Self, Error> {
        let mesh = &body.mesh;
        let shell = Shell::new(mesh, &body.air, &body.cut, body.severed.as_ref())?;
        let none = Pieces::default();
        let walls = body.severed.as_ref().map_or(&none, |severed| &severed.tet_pieces);
        // Vertices: those of the mesh, those of the shell, and points on walls in both.
        let shell_count = shell.positions.len() as u32;
        let (vertices, all) = (mesh.positions.len() as u32, shell.first_extra + shell_count);
        let behind = |tet: &[u32; 4]| tet.map(|v| if v < vertices { v } else { v + shell_count });
        let in_shell = |tet: &[u32; 4]| tet.map(|v| if v < all { v } else { v + walls.points.len() as u32 });
        // Pieces are out when their blades have cut to their ends.
        let [at_start, at_end] = [0.0, time_s].map(|time_s| body.finished_cuts(time_s));
        let (at_start, at_end) = (at_start.as_slice(), at_end.as_slice());
        let pieces = body.severed.as_ref().map_or(&[][..], |severed| &severed.taken_out);
        let first_piece = shell.taken_out.len() - pieces.len();
        let tets_of = |blade: usize| {
            let piece = blade.checked_sub(first_piece).map_or(&[][..], |piece| &pieces[piece]);
            (piece.iter().map(behind), shell.taken_out[blade].iter().map(in_shell))
        };
        let blades = || 0..shell.taken_out.len();
        let kept = || blades().filter(|&blade| !at_end[blade]).map(tets_of);
        let body_tets: Vec<[u32; 4]> = mesh.tets[..mesh.whole_tets()]
            .iter()
            .copied()
            .chain(walls.simplices.iter().map(behind))
            .chain(kept().flat_map(|(in_body, _)| in_body))
            .collect();
        let around = shell.tets.iter().copied().chain(shell.pieces.simplices.iter().map(in_shell));
        let around = around.chain(kept().flat_map(|(_, in_shell)| in_shell));
        let out = |first: bool| {
            let blades = blades().filter(move |&blade| at_end[blade] && at_start[blade] == first);
            blades.map(tets_of).flat_map(|(in_body, in_shell)| in_body.chain(in_shell))
        };
        let mut removed: Vec<[u32; 4]> =
            body.removed.tets.iter().chain(&shell.removed).copied().chain(out(true)).collect();
        let removed_at_start = removed.len();
        removed.extend(out(false));
        let extra = |positions: &[Point3<f32>]| {
            let followed = shell.follow(&mesh.positions, positions);
            let nodes = [positions, &followed].concat();
            let points = walls.points.iter().chain(&shell.pieces.points).map(|point| point.at(&nodes));
            followed.iter().copied().chain(points).collect::<Vec<_>>()
        };
        let (at_rest, moved) = (extra(&mesh.positions), extra(deformed));
        let (divided, whole) = (mesh.tets[mesh.whole_tets()..].as_flattened(), body_tets.len());
        let tets: Vec<[u32; 4]> = body_tets.into_iter().chain(around).collect();
        let cut = tets[mesh.whole_tets()..whole].iter().chain(&tets[whole + shell.tets.len()..]);
        let mut on_walls = vec![false; mesh.positions.len() + at_rest.len()];
        divided.iter().chain(cut.flatten()).for_each(|&v| on_walls[v as usize] = true);
        let reaches = |tet: u32| tets[tet as usize].iter().any(|&v| on_walls[v as usize]);
        let at_walls = (0..tets.len() as u32).filter(|&tet| reaches(tet)).collect();
        Ok(Self {
            body,
            body_tets: whole,
            at_walls,
            tets,
            rest: [mesh.positions.as_slice(), &at_rest].concat(),
            on_device: on_device.and_then(|positions| stages.append(positions, &moved)),
            deformed: [deformed, &moved].concat(),
            removed,
            removed_at_start,
        })
    }

    /// Two opposite corners of a box in mm, along the axes of the patient, that holds all walls of
    /// wounds at rest and deformed. `None` without a wound.
    pub(crate) fn walls_mm(&self) -> Option<[Point3<f64>; 2]> {
        let at_walls = self.at_walls.iter().map(|&tet| &self.tets[tet as usize]);
        let nodes = at_walls.chain(&self.removed).flatten().map(|&v| v as usize);
        let mut points = nodes.flat_map(|v| [self.rest[v], self.deformed[v]]);
        let first = points.next()?;
        let (low, high) = points.fold((first, first), |(low, high), p| (low.inf(&p), high.sup(&p)));
        let origin_mm = self.body.mesh.frame.origin_mm;
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
        let (resampled, report) = self.apply_to_centers(volume, stages, progress)?;
        let warp = self.warp(&self.deformed, &self.tets, self.body_tets, &self.removed);
        Ok((blend_walls(volume, &warp, &self.at_walls, resampled)?.0, report))
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
            &self.warp(&self.deformed, &self.tets, self.body_tets, &self.removed),
            self.on_device.as_ref(),
            &|done, _total| progress.advance(done as u64),
        )?;
        let report = Resample {
            covered_voxels: report.covered_voxels as u64,
            folds: report.folds as u64,
            vacated_voxels: report.vacated_voxels as u64,
        };
        Ok((volume, report))
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
        let (removed, later) = self.removed.split_at(self.removed_at_start);
        if removed.is_empty() {
            return Ok(Cow::Borrowed(volume));
        }
        let mut touched = vec![false; self.rest.len()];
        removed.iter().flatten().for_each(|&v| touched[v as usize] = true);
        let touches = |tet: &&[u32; 4]| tet.iter().any(|&v| touched[v as usize]);
        let around = |tets: &[[u32; 4]]| -> Vec<[u32; 4]> { tets.iter().filter(touches).copied().collect() };
        let (body, shell) = self.tets.split_at(self.body_tets);
        let (body, shell) = (around(body), around(shell));
        let tets = [body.as_slice(), &shell, &around(later)].concat();
        let warp = self.warp(&self.rest, &tets, body.len(), removed);
        let progress = |done: usize, _total: usize| progress.advance(done as u64);
        Ok(Cow::Owned(stages.resample(volume, &warp, None, &progress)?.0))
    }

    fn warp<'w>(
        &'w self,
        deformed: &'w [Point3<f32>],
        tets: &'w [[u32; 4]],
        body_tets: usize,
        removed: &'w [[u32; 4]],
    ) -> Warp<'w> {
        Warp {
            origin_mm: self.body.mesh.frame.origin_mm,
            rest: &self.rest,
            deformed,
            tets,
            body_tets,
            removed,
        }
    }
}
