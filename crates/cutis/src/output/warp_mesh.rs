//! The mesh through which a CT is resampled: a body and the shell of air around it.

use cutis_mesh::sever::{Embedded, Pieces};
use cutis_mesh::{MeshError, Shell};
use cutis_resample::Warp;
use nalgebra::Point3;
use rayon::prelude::*;

use crate::body::Body;

/// The tetrahedra of a body and of the partly empty shell that follows its surface.
pub(crate) struct WarpMesh {
    /// World position of the local origin, mm.
    pub(super) origin_mm: Point3<f64>,
    /// Number of `tets` that belong to the body.
    pub(super) body_tets: usize,
    pub(super) tets: Vec<[u32; 4]>,
    /// Rest positions in local meters: the vertices of the mesh, those of the shell, and points on
    /// walls in both.
    pub(crate) rest: Vec<Point3<f32>>,
    /// The tetrahedra that incisions removed and those of the pieces that were taken out.
    pub(super) removed: Vec<[u32; 4]>,
    /// The tets next to the walls of wounds, as indices into `tets`.
    pub(super) at_walls: Vec<u32>,
    /// Number of `removed` that are missing before the first frame. The others were taken out
    /// later.
    pub(super) removed_at_start: usize,
    shell: Shell,
    /// Points on the walls in the body and in the shell.
    points: Vec<Embedded>,
}

impl WarpMesh {
    /// Prepares the mesh of a body. `time_s` is when the last cuts were made: a piece that is taken
    /// out later is part of the body.
    ///
    /// # Errors
    /// The errors of [`Shell::new`].
    pub(crate) fn new(body: &Body, time_s: f64) -> Result<Self, MeshError> {
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
        let in_body = body.severed.as_ref().map_or(&[][..], |severed| &severed.taken_out);
        let tets_of = |blade: usize| {
            let in_body = in_body.get(blade).map_or(&[][..], |tets| tets);
            (in_body.iter().map(behind), shell.taken_out[blade].iter().map(in_shell))
        };
        let blades = || 0..shell.taken_out.len();
        let kept = || blades().filter(|&blade| !at_end[blade]).map(tets_of);
        let in_pieces = walls.simplices.iter().map(behind).chain(kept().flat_map(|(in_body, _)| in_body));
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
        let points: Vec<Embedded> = walls.points.iter().chain(&shell.pieces.points).copied().collect();
        let at_rest = further(&shell, &points, &mesh.positions, &mesh.positions);
        let (undivided, divided) = mesh.tets.split_at(mesh.whole_tets());
        let mut tets = Vec::with_capacity(mesh.tets.len() + shell.tets.len());
        tets.extend_from_slice(undivided);
        tets.extend(in_pieces);
        let body_tets = tets.len();
        tets.extend(around);
        let cut = tets[undivided.len()..body_tets].iter().chain(&tets[body_tets + shell.tets.len()..]);
        let mut on_walls = vec![false; mesh.positions.len() + at_rest.len()];
        divided.iter().chain(cut).flatten().for_each(|&v| on_walls[v as usize] = true);
        let reaches = |tet: &u32| tets[*tet as usize].iter().any(|&v| on_walls[v as usize]);
        let at_walls = (0..tets.len() as u32).into_par_iter().filter(reaches).collect();
        Ok(Self {
            origin_mm: mesh.frame.origin_mm,
            body_tets,
            at_walls,
            tets,
            rest: [mesh.positions.as_slice(), &at_rest].concat(),
            removed,
            removed_at_start,
            shell,
            points,
        })
    }

    /// Positions of the shell and of the points on walls, for these positions of the body's mesh.
    pub(crate) fn further(&self, positions: &[Point3<f32>]) -> Vec<Point3<f32>> {
        further(&self.shell, &self.points, &self.rest[..self.shell.first_extra as usize], positions)
    }

    /// The warp to deformed positions of all vertices.
    pub(crate) fn warp<'w>(&'w self, deformed: &'w [Point3<f32>]) -> Warp<'w> {
        let Self { origin_mm, ref rest, ref tets, body_tets, ref removed, .. } = *self;
        Warp { origin_mm, rest, deformed, tets, body_tets, removed }
    }
}

fn further(
    shell: &Shell,
    points: &[Embedded],
    rest: &[Point3<f32>],
    positions: &[Point3<f32>],
) -> Vec<Point3<f32>> {
    let followed = shell.follow(rest, positions);
    let nodes = [positions, &followed].concat();
    followed.iter().copied().chain(points.iter().map(|point| point.at(&nodes))).collect()
}
