//! Leaving out by construction: the region of a scene, beyond which nothing is simulated, and its graded lattice.

use cutis_mesh::{Grading, Lattice, MeshError, Planes, Slit, TetMesh, TissueMask};
use cutis_volume::{Grid, Volume, sample};
use nalgebra::{Point3, Vector3, distance};

use crate::Error;
use crate::body::Body;
use crate::report::MemoryPart;
use crate::scene::{HandleSection, LoadedScene, Scene, Zone};

/// The lattice of a scene, even or graded.
pub(crate) fn lattice(loaded: &LoadedScene, volume: &Volume) -> Result<Lattice, Error> {
    let section = &loaded.scene.lattice;
    let even = sample::lattice_grid(volume.grid(), section.size()).map_err(loaded.blame("lattice"))?;
    let lattice = match &section.grading {
        None => Lattice::new(even, section.split.into()),
        Some(grading) => {
            let Some(zone) = grading.zone() else {
                return Err(key(loaded, "lattice.grading", "", "no zone"));
            };
            let fine = fine_zone(&loaded.scene, zone, &even);
            let steps = Grading { growth: grading.growth, coarsest: grading.coarsest };
            let planes = Planes::new(&even, fine, &steps).map_err(loaded.blame("lattice.grading"))?;
            Lattice::graded(even, section.split.into(), planes)
        }
    };
    lattice.map_err(loaded.blame("lattice"))
}

/// From and to along each axis of the lattice, in its steps.
fn fine_zone(scene: &Scene, zone: Zone, even: &Grid) -> [[f64; 2]; 3] {
    let mut hull = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    let mut add = |mm: [f64; 3], radius_mm: f64| {
        let index = even.affine.to_index(mm.into());
        for axis in 0..3 {
            // The index rises by so much per millimeter in the direction in which it rises fastest.
            let per_mm = Vector3::from_fn(|world, _| {
                even.affine.to_index(Point3::origin() + Vector3::ith(world, 1.0))[axis]
                    - even.affine.to_index(Point3::origin())[axis]
            });
            let reach = radius_mm * per_mm.norm();
            hull[axis] = [hull[axis][0].min(index[axis] - reach), hull[axis][1].max(index[axis] + reach)];
        }
    };
    match zone {
        Zone::Box(min, max) => {
            let corner =
                |n: usize| std::array::from_fn(|axis| if n >> axis & 1 == 0 { min[axis] } else { max[axis] });
            (0..8).for_each(|n| add(corner(n), 0.0));
        }
        Zone::Around(around) => {
            for incision in &scene.incision {
                for end in [incision.from_mm, incision.to_mm] {
                    add(end, around + incision.depth_mm);
                }
            }
            scene.handle.iter().for_each(|handle| add(handle.at_mm, around + handle.radius_mm));
        }
    }
    hull
}

/// The mesh of the whole body, or of the scene's region.
pub(crate) fn mesh(
    loaded: &LoadedScene,
    whole: &TissueMask,
    hu: &[f32],
    slits: &[Slit],
) -> Result<TetMesh, Error> {
    let Some(zone) = loaded.scene.lattice.region.as_ref().and_then(|region| region.zone()) else {
        return whole.mesh(hu).map_err(loaded.blame("tissue"));
    };
    let frame = cutis_mesh::Frame::center_of(whole.lattice().grid());
    let holds = |mm: Point3<f64>| match zone {
        Zone::Box(min, max) => (0..3).all(|axis| (min[axis]..=max[axis]).contains(&mm[axis])),
        Zone::Around(around) => near_action(&loaded.scene, slits, frame.to_local(mm), mm, around),
    };
    whole.mesh_within(hu, &whole.vertices_where(holds)).map_err(|error| match error {
        MeshError::RegionEmpty { .. } => key(loaded, "lattice.region", &shown(zone), &error.to_string()),
        other => loaded.blame("tissue")(other),
    })
}

/// Whether a place, given in the frame of the body and in mm, lies within `around` mm of an incision or of what a handle grabs.
fn near_action(scene: &Scene, slits: &[Slit], local: Point3<f32>, mm: Point3<f64>, around: f64) -> bool {
    let near =
        |handle: &HandleSection| distance(&mm, &Point3::from(handle.at_mm)) <= handle.radius_mm + around;
    slits.iter().any(|slit| slit.distance(local) * 1000.0 <= around) || scene.handle.iter().any(near)
}

/// The share of a body's tetrahedra that a region of `around` mm would hold.
pub(crate) fn share_around(scene: &Scene, body: &Body, around: f64) -> f64 {
    let mesh = &body.mesh;
    let near =
        |&local: &Point3<f32>| near_action(scene, &body.cut.slits, local, mesh.frame.to_mm(local), around);
    let inside: Vec<bool> = mesh.positions.iter().map(near).collect();
    let held = mesh.tets.iter().filter(|tet| tet.iter().any(|&vertex| inside[vertex as usize]));
    held.count() as f64 / mesh.tets.len().max(1) as f64
}

/// Points along each axis that a lattice would have if it were as fine everywhere as it is in its fine zone.
pub(crate) fn even_shape(lattice: &Lattice) -> [usize; 3] {
    let even = |planes: &Planes| {
        planes.axes().each_ref().map(|axis| axis.last().map_or(0, |last| *last as usize) + 1)
    };
    lattice.planes().map_or(lattice.grid().shape, even)
}

/// Names the key that leaves out what an incision cuts.
pub(crate) fn name(loaded: &LoadedScene, error: MeshError) -> Error {
    let MeshError::IncisionBeyond { incision, distance_mm, coarse, .. } = error else {
        return loaded.blame("incision")(error);
    };
    let section = &loaded.scene.lattice;
    let (name, zone) = if coarse {
        ("lattice.grading", section.grading.as_ref().and_then(|grading| grading.zone()))
    } else {
        ("lattice.region", section.region.as_ref().and_then(|region| region.zone()))
    };
    let Some(zone) = zone else { return loaded.blame("incision")(error) };
    let remedy = match zone {
        Zone::Around(_) if !coarse => format!("make around_mm at least {:.0}", distance_mm.ceil()),
        Zone::Around(_) => "make around_mm larger".into(),
        Zone::Box(..) => "make the box larger".into(),
    };
    key(loaded, name, &shown(zone), &format!("does not hold all of incision[{incision}]: {error}; {remedy}"))
}

/// Refuses a handle that grabs what a region leaves out, or what lies where the lattice is coarse.
pub(crate) fn check_handles(loaded: &LoadedScene, mesh: &TetMesh) -> Result<(), Error> {
    let section = &loaded.scene.lattice;
    let (lattice, grid) = (&mesh.lattice, mesh.lattice.grid());
    let grabbed = |position: Point3<f32>| {
        let at = position.cast::<f64>();
        let grabs = |handle: &HandleSection| {
            let center = mesh.frame.to_local(handle.at_mm.into()).cast::<f64>();
            distance(&at, &center) <= handle.radius_mm / 1000.0
        };
        loaded.scene.handle.iter().position(grabs)
    };
    let refuse = |name: &str, zone: Option<Zone>, handle: usize, position: Point3<f32>| {
        let mm: [f64; 3] = mesh.frame.to_mm(position).into();
        let why = format!(
            "does not hold all of handle[{handle}]: it grabs a vertex of the body at {mm:.1?} mm, which lies outside; \
             make it larger"
        );
        Err(key(loaded, name, &zone.map(shown).unwrap_or_default(), &why))
    };
    if let Some(frozen) = &mesh.inactive {
        let zone = section.region.as_ref().and_then(|region| region.zone());
        let border = mesh.positions.iter().zip(&frozen.border).filter(|(_, border)| **border);
        let beyond = frozen.points.iter().enumerate().filter(|(_, frozen)| **frozen);
        let beyond = beyond.map(|(point, _)| mesh.frame.to_local(lattice.mm(grid.point(point))));
        for position in border.map(|(position, _)| *position).chain(beyond) {
            if let Some(handle) = grabbed(position) {
                return refuse("lattice.region", zone, handle, position);
            }
        }
    }
    if let Some(planes) = lattice.planes() {
        let zone = section.grading.as_ref().and_then(|grading| grading.zone());
        for (vertex, &position) in mesh.positions.iter().enumerate() {
            if let (false, Some(handle)) = (planes.is_fine(mesh.point(vertex as u32)), grabbed(position)) {
                return refuse("lattice.grading", zone, handle, position);
            }
        }
    }
    Ok(())
}

impl Body {
    /// Largest displacement of a vertex that shares a tetrahedron with one that the region holds, mm: what of the motion
    /// arrives where the region ends. None without a region that leaves something out.
    pub(crate) fn border_displacement_mm(&self, deformed: &[Point3<f32>]) -> Option<f64> {
        let frozen = self.mesh.inactive.as_ref().filter(|frozen| frozen.tets > 0)?;
        let at_border = |tet: &&[u32; 4]| tet.iter().any(|&v| frozen.border[v as usize]);
        let moved =
            |&v: &u32| f64::from((deformed[v as usize] - self.mesh.positions[v as usize]).norm()) * 1e3;
        Some(self.mesh.tets.iter().filter(at_border).flatten().map(moved).fold(0.0, f64::max))
    }

    /// The skin of the whole body: places of the mesh's vertices, as given, and of those that a region left out; triangles.
    pub(crate) fn whole_skin(&self, positions: &[Point3<f32>]) -> (Vec<Point3<f32>>, Vec<[u32; 3]>) {
        let still = &self.inactive_skin;
        ([positions, &still.positions].concat(), [self.skin.as_slice(), &still.triangles].concat())
    }
}

/// What a region and a graded lattice leave out, in words. `memory` is what the solver takes.
pub(crate) fn left_out(body: &Body, memory: &[MemoryPart], lines: &mut Vec<String>) {
    let mesh = &body.mesh;
    if let Some(frozen) = mesh.inactive.as_ref().filter(|frozen| frozen.tets > 0) {
        let kept_and_left = |part: &str| match part {
            "vertices" => (mesh.positions.len(), frozen.vertices),
            "distance" => (mesh.edges.len(), frozen.edges),
            "volume" => (mesh.tets.len(), frozen.tets),
            "stc" => (body.skin.len(), body.inactive_skin.triangles.len()),
            _ => (0, 0),
        };
        let saved = |part: &MemoryPart| {
            let (kept, left) = kept_and_left(&part.part);
            part.bytes as f64 * left as f64 / kept.max(1) as f64
        };
        let bytes: f64 = memory.iter().map(saved).sum();
        lines.push(format!(
            "region: {} of {} tetrahedra and {} of {} vertices lie beyond it; they are neither stored nor simulated, which \
             saves about {:.1} MB of the solver's memory",
            frozen.tets,
            frozen.tets + mesh.tets.len(),
            frozen.vertices,
            frozen.vertices + mesh.positions.len(),
            bytes / 1e6
        ));
    }
    if mesh.lattice.planes().is_some() {
        let product = |shape: [usize; 3]| shape.iter().product::<usize>();
        let shape = mesh.lattice.grid().shape;
        lines.push(format!(
            "grading: the lattice has {} points instead of the {} that it would have if it were as fine everywhere",
            product(shape),
            product(even_shape(&mesh.lattice))
        ));
    }
}

/// A region that saves nothing is worth a note.
pub(crate) fn idle(body: &Body) -> Option<String> {
    let frozen = body.mesh.inactive.as_ref()?;
    (frozen.tets == 0).then(|| "lattice.region holds the whole body: it leaves nothing out".to_owned())
}

fn key(loaded: &LoadedScene, key: &str, value: &str, why: &str) -> Error {
    Error::SceneKey { file: loaded.file.clone(), key: key.into(), value: value.into(), why: why.into() }
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

    use super::*;
    use crate::ct::source;

    #[test]
    fn the_share_that_a_region_would_hold_is_what_it_holds() {
        let body = |around: Option<f64>| {
            let region = around.map_or(String::new(), |mm| format!(", region = {{ around_mm = {mm} }}"));
            let text = format!(
                "volume = {{ phantom = {{ size = [32, 32, 24], seed = 1 }} }}\n\
                 lattice = {{ spacing_mm = 12.0{region} }}\n\
                 handle = [{{ at_mm = [-40, 100, 0], radius_mm = 30, move_mm = [0, 20, 5] }}]"
            );
            let loaded = Scene::parse(&text, Path::new("test"), Path::new(""), &[]).unwrap();
            let body = Body::build(&loaded, &source::load(&loaded).unwrap().volume).unwrap();
            (loaded.scene, body)
        };
        let (scene, whole) = body(None);
        for around in [20.0, 60.0] {
            let held = body(Some(around)).1.mesh.tets.len() as f64 / whole.mesh.tets.len() as f64;
            assert!((0.01..0.9).contains(&held), "{held}");
            assert_eq!(share_around(&scene, &whole, around), held);
        }
    }
}
