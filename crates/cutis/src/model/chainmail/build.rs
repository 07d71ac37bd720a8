//! Builds the chain of a cut body: materials, links, fixed elements, handles and timed cuts.

use std::collections::HashMap;

use cutis_chainmail::{Chain, FARTHEST_STEPS, NO_MATERIAL};
use cutis_mesh::{Slit, TetMesh};
use nalgebra::{Point3, Vector3};

use super::{ChainCut, ChainHandle, ChainmailModel};
use crate::Error;
use crate::body::Body;
use crate::model::{ModelInput, first_frame};
use crate::scene::IncisionSection;

impl ChainmailModel {
    /// Builds the chain of a scene.
    ///
    /// # Errors
    /// [`Error`] for a value of the scene that does not work with this body.
    pub(crate) fn build(input: &ModelInput<'_>) -> Result<Self, Error> {
        let ModelInput { file, scene, body } = *input;
        let mesh = &body.mesh;
        let grid = mesh.lattice.grid();
        let section = scene.chainmail.clone().unwrap_or_default();
        let table = section.table(file, &scene.tissue)?;
        let mut materials = vec![NO_MATERIAL; grid.len()];
        for (&element, &hu) in mesh.lattice_index.iter().zip(&mesh.hu) {
            // Tissue is at or above `tissue.air_below_hu`, and the first material begins there or
            // below.
            materials[element as usize] = table.at(hu).unwrap_or_default();
        }
        let mut chain = Chain::new(grid.shape, grid.affine.spacing_mm(), table.materials(), materials)
            .map_err(|error| file.blame("chainmail")(Error::Chain(error)))?;
        let linked = linked(mesh, &body.removed.edges);
        chain.cut(|_, a, b| linked[a as usize] & axis_bit(b - a, grid.shape) == 0);
        let handles = handles(input)?;
        let mut fixed = body.fixed(file, &scene.fixed)?;
        body.grabbed.iter().flatten().for_each(|&vertex| fixed[vertex as usize] = false);
        let elements = mesh.lattice_index.clone();
        let held: Vec<u32> =
            elements.iter().zip(&fixed).filter(|(_, fixed)| **fixed).map(|(element, _)| *element).collect();
        chain.fix(&held).map_err(|error| file.blame("chainmail")(Error::Chain(error)))?;
        let cuts = cuts(&scene.incision, body);
        let real = 0..mesh.real_vertices();
        let motionless = real.filter(|&vertex| fixed[vertex] && !body.is_removed(vertex as u32));
        Ok(Self {
            chain,
            elements,
            handles,
            cuts,
            fixed: motionless.count(),
            relax_per_frame: section.relax_per_frame,
        })
    }
}

/// Per lattice point, a bit for each link to a later point that is an edge of the uncut body.
/// `removed` holds the edges that the incisions removed.
fn linked(mesh: &TetMesh, removed: &[[u32; 2]]) -> Vec<u8> {
    let grid = mesh.lattice.grid();
    let mut linked = vec![0_u8; grid.len()];
    for [a, b] in mesh.edges.iter().chain(removed).filter_map(|edge| along_axis(mesh, edge)) {
        linked[a as usize] |= axis_bit(b - a, grid.shape);
    }
    linked
}

/// The lattice points of an edge in ascending order, if the edge lies along an axis.
fn along_axis(mesh: &TetMesh, edge: &[u32; 2]) -> Option<[u32; 2]> {
    let [p, q] = edge.map(|vertex| mesh.point(vertex));
    let apart = (0..3).filter(|&axis| p[axis] != q[axis]).count();
    let [a, b] = edge.map(|vertex| mesh.lattice_index[vertex as usize]);
    (apart == 1).then(|| [a.min(b), a.max(b)])
}

/// The bit of the axis along which two lattice points are neighbors, from the difference of their
/// numbers; 0 if they are not neighbors. A lattice has at least two points along each axis.
fn axis_bit(apart: u32, [nx, ny, _]: [usize; 3]) -> u8 {
    match apart as usize {
        1 => 1,
        apart if apart == nx => 2,
        apart if apart == nx * ny => 4,
        _ => 0,
    }
}

/// The handles of the scene, with the elements that they grab. Virtual vertices have no element of
/// their own.
fn handles(input: &ModelInput<'_>) -> Result<Vec<ChainHandle>, Error> {
    let ModelInput { file, scene, body } = *input;
    let grid = body.mesh.lattice.grid();
    let mut grabbed_by = HashMap::new();
    let mut handles = Vec::new();
    for (n, (handle, grabbed)) in scene.handle.iter().zip(&body.grabbed).enumerate() {
        let real = grabbed.iter().filter(|&&v| (v as usize) < body.mesh.real_vertices());
        let elements: Vec<u32> = real.map(|&v| body.mesh.lattice_index[v as usize]).collect();
        if let Some(other) = elements.iter().find_map(|&element| grabbed_by.insert(element, n)) {
            let why = format!("it grabs vertices that handle[{other}] grabs already");
            return Err(file.bad_key(
                &format!("handle[{n}].at_mm"),
                &format!("{:?}", handle.center_mm()),
                &why,
            ));
        }
        let origin = grid.affine.to_index(Point3::origin());
        let steps = grid.affine.to_index(Vector3::from(handle.displacement_mm()).into()) - origin;
        let reaches = |&element: &u32| {
            let rest = grid.point(element as usize);
            (0..3).all(|axis| (rest[axis] as f64 + steps[axis]).abs() <= FARTHEST_STEPS)
        };
        if !elements.iter().all(reaches) {
            let why = format!("must end within {FARTHEST_STEPS} steps of the first lattice point");
            return Err(file.bad_key(
                &format!("handle[{n}].move_mm"),
                &format!("{:?}", handle.displacement_mm()),
                &why,
            ));
        }
        let frame = u32::try_from(first_frame(handle.at_s, scene.solver.dt_s)).unwrap_or(u32::MAX);
        handles.push(ChainHandle { elements, frame, steps, over_s: handle.over_s });
    }
    Ok(handles)
}

/// The links that each incision with a width cuts: those that are in no tetrahedron any more. The
/// first incision that takes a tetrahedron removes it.
fn cuts(incisions: &[IncisionSection], body: &Body) -> Vec<ChainCut> {
    let mesh = &body.mesh;
    // Such an incision has one segment.
    let wide = incisions.iter().filter(|incision| incision.width_mm.is_some());
    let slits = wide.zip(body.cut.slits.iter().filter(|slit| !slit.removes_nothing()));
    let mut slits: Vec<(f64, &Slit)> = slits.map(|(cut, slit)| (cut.at_s, slit)).collect();
    slits.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let mut cuts: Vec<ChainCut> =
        slits.iter().map(|&(at_s, _)| ChainCut { at_s, links: Vec::new() }).collect();
    let mut removed_by = HashMap::new();
    for tet in &body.removed.tets {
        let corners = tet.map(|vertex| mesh.positions[vertex as usize]);
        let Some(cut) = slits.iter().position(|(_, slit)| slit.cuts(&corners)) else { continue };
        for (a, &p) in tet.iter().enumerate() {
            for &q in &tet[a + 1..] {
                let last = removed_by.entry([p.min(q), p.max(q)]).or_insert(cut);
                *last = cut.max(*last);
            }
        }
    }
    for edge in &body.removed.edges {
        if let (Some(link), Some(&cut)) = (along_axis(mesh, edge), removed_by.get(edge)) {
            cuts[cut].links.push(link);
        }
    }
    cuts
}
