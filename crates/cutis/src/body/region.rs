//! The region of interest: tissue outside it stays where it is and is not simulated.

use cutis_mesh::{Frame, MeshError, TetMesh, TissueMask};
use nalgebra::{Point3, distance};

use super::BodySections;
use super::cut_error::cut_error;
use super::handles::Grasp;
use super::memory;
use crate::Error;
use crate::scene::{HandleSection, LatticeSection, PickedRegion, Zone};

/// The mesh of the whole body, or of the scene's region of interest. `from_cuts_mm` returns the
/// distance of a place, in local meters, from the cuts.
pub(super) fn mesh(
    sections: &BodySections<'_>,
    whole: &TissueMask,
    hu: &[f32],
    from_cuts_mm: &(dyn Fn(Point3<f32>) -> f64 + Sync),
) -> Result<TetMesh, Error> {
    let file = sections.file;
    let Some(zone) = region_zone(sections.lattice) else {
        memory::check_tets(sections, whole.tets())?;
        return whole.mesh(hu).map_err(file.blame("tissue"));
    };
    let frame = Frame::center_of(whole.lattice().grid());
    let holds = |mm: Point3<f64>| match zone {
        Zone::Box(min, max) => (0..3).all(|axis| (min[axis]..=max[axis]).contains(&mm[axis])),
        Zone::Around(around) => near_action(sections.handles, from_cuts_mm(frame.to_local(mm)), mm, around),
    };
    let inside = whole.vertices_where(holds);
    let count = |flags: &[bool]| flags.iter().filter(|&&flag| flag).count().max(1) as u64;
    let share = whole.tets() as u64 * count(&inside) / count(whole.vertices());
    memory::check_tets(sections, share as usize)?;
    whole.mesh_within(hu, &inside).map_err(|error| match error {
        MeshError::RegionEmpty { .. } => file.bad_key("lattice.region", &shown(zone), &error.to_string()),
        other => file.blame("tissue")(other),
    })
}

/// Whether a place in world mm lies within `around` mm of a handle's sphere, or of the cuts, which
/// are `from_cuts` mm away.
pub(super) fn near_action(handles: &[HandleSection], from_cuts: f64, mm: Point3<f64>, around: f64) -> bool {
    let near = |handle: &HandleSection| {
        distance(&mm, &Point3::from(handle.center_mm())) <= handle.radius_mm + around
    };
    from_cuts <= around || handles.iter().any(near)
}

/// Turns the error of an incision into one that names the section whose zone is too small for it.
pub(super) fn incision_error(sections: &BodySections<'_>, error: MeshError) -> Error {
    let MeshError::IncisionBeyond { incision, distance_mm, coarse, .. } = error else {
        return cut_error(sections.file)(error);
    };
    let (name, zone) = if coarse {
        ("lattice.grading", grading_zone(sections.lattice))
    } else {
        ("lattice.region", region_zone(sections.lattice))
    };
    let Some(zone) = zone else { return sections.file.blame("incision")(error) };
    let remedy = match zone {
        Zone::Around(_) if !coarse => format!("make around_mm at least {:.0}", distance_mm.ceil()),
        Zone::Around(_) => "make around_mm larger".into(),
        Zone::Box(..) => "make the box larger".into(),
    };
    let why = format!("does not hold all of incision[{incision}]: {error}; {remedy}");
    sections.file.bad_key(name, &shown(zone), &why)
}

/// Refuses a handle that grabs vertices outside the region of interest, or outside the fine zone of
/// a graded lattice. `mesh` is not cut yet.
pub(super) fn check_handles(sections: &BodySections<'_>, mesh: &TetMesh) -> Result<(), Error> {
    let (lattice, grid) = (&mesh.lattice, mesh.lattice.grid());
    let grasps: Vec<Grasp> = sections.handles.iter().map(|handle| Grasp::new(handle, &mesh.frame)).collect();
    let grabbed = |position: Point3<f32>| grasps.iter().position(|grasp| grasp.holds(position));
    let refuse = |name: &str, zone: Option<Zone>, handle: usize, position: Point3<f32>| {
        let mm: [f64; 3] = mesh.frame.to_mm(position).into();
        let why = format!(
            "does not hold all of handle[{handle}]: it grabs a vertex of the body at {mm:.1?} mm, which lies \
             outside; make it larger"
        );
        Err(sections.file.bad_key(name, &zone.map(shown).unwrap_or_default(), &why))
    };
    if let Some(inactive) = &mesh.inactive {
        let border = mesh.positions.iter().zip(&inactive.border).filter(|(_, border)| **border);
        let outside = inactive.points.iter().enumerate().filter(|(_, inactive)| **inactive);
        let outside = outside.map(|(point, _)| mesh.frame.to_local(lattice.mm(grid.point(point))));
        for position in border.map(|(position, _)| *position).chain(outside) {
            if let Some(handle) = grabbed(position) {
                return refuse("lattice.region", region_zone(sections.lattice), handle, position);
            }
        }
    }
    if let Some(planes) = lattice.planes() {
        for (vertex, &position) in mesh.positions.iter().enumerate() {
            if let (false, Some(handle)) = (planes.is_fine(mesh.point(vertex as u32)), grabbed(position)) {
                return refuse("lattice.grading", grading_zone(sections.lattice), handle, position);
            }
        }
    }
    Ok(())
}

/// Warning about a region of interest that leaves nothing out.
pub(super) fn warning(lattice: &LatticeSection, mesh: &TetMesh) -> Option<String> {
    let inactive = mesh.inactive.as_ref()?;
    (inactive.tets == 0 && picked(lattice).is_none())
        .then(|| "lattice.region holds the whole body: it leaves nothing out".to_owned())
}

/// What is known about a region that the program picked.
pub(super) fn picked(lattice: &LatticeSection) -> Option<PickedRegion> {
    lattice.region.as_ref()?.picked()
}

pub(super) fn region_zone(lattice: &LatticeSection) -> Option<Zone> {
    lattice.region.as_ref()?.zone()
}

fn grading_zone(lattice: &LatticeSection) -> Option<Zone> {
    lattice.grading.as_ref()?.zone()
}

fn shown(zone: Zone) -> String {
    match zone {
        Zone::Around(around) => format!("{{ around_mm = {around} }}"),
        Zone::Box(min, max) => format!("{{ min_mm = {min:?}, max_mm = {max:?} }}"),
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::body::{Body, BodySections};
    use crate::ct::source;
    use crate::scene::Scene;

    #[test]
    fn the_predicted_share_of_a_region_is_the_share_that_it_holds() {
        let body = |around: Option<f64>| {
            let region = around.map_or(String::new(), |mm| format!(", region = {{ around_mm = {mm} }}"));
            let text = format!(
                "volume = {{ phantom = {{ size = [32, 32, 24], seed = 1 }} }}\n\
                 lattice = {{ spacing_mm = 12.0{region} }}\n\
                 handle = [{{ at_mm = [-40, 100, 0], radius_mm = 30, move_mm = [0, 20, 5] }}]"
            );
            let loaded = Scene::parse(&text, Path::new("test"), Path::new(""), &[]).unwrap();
            let source = source::load(&loaded).unwrap();
            let body = Body::build(&BodySections::of(&loaded), &source.volume).unwrap();
            (loaded.scene, body)
        };
        let (scene, whole) = body(None);
        for around in [20.0, 60.0] {
            let held = body(Some(around)).1.mesh.tets.len() as f64 / whole.mesh.tets.len() as f64;
            assert!((0.01..0.9).contains(&held), "{held}");
            assert_eq!(whole.share_around(&scene.handle, around), held);
        }
    }
}
