//! From the cut body to a chain: materials, links, what is fixed, what handles grab, and what is cut when.

use std::collections::HashMap;
use std::path::Path;

use cutis_chainmail::{Chain, ChainError, FARTHEST_STEPS, Material, MaterialTable, NO_MATERIAL};
use cutis_mesh::{Slit, TetMesh};
use nalgebra::{Point3, Vector3, distance};

use crate::Error;
use crate::body::Body;
use crate::scene::{ChainMaterialSection, ChainmailSection, LoadedScene, MaterialsChoice, TissueSection};

/// A chain over the lattice of a body: element numbers are those of lattice points.
pub(crate) struct ChainBody {
    pub(crate) chain: Chain,
    /// Element of each mesh vertex.
    pub(crate) elements: Vec<u32>,
    pub(crate) handles: Vec<ChainHandle>,
    /// In the order in which they are made.
    pub(crate) cuts: Vec<ChainCut>,
    /// Vertices that do not move.
    pub(crate) fixed: usize,
    pub(crate) relax_per_frame: u32,
}

/// Elements that are dragged along a straight line.
pub(crate) struct ChainHandle {
    pub(crate) elements: Vec<u32>,
    /// The whole path, in steps of the lattice.
    pub(crate) steps: Vector3<f64>,
    /// Time that it takes, s.
    pub(crate) over_s: f64,
}

/// Links that an incision cuts.
pub(crate) struct ChainCut {
    pub(crate) at_s: f64,
    pub(crate) links: Vec<[u32; 2]>,
}

impl ChainBody {
    /// Builds the chain of a scene.
    pub(crate) fn build(loaded: &LoadedScene, body: &Body) -> Result<Self, Error> {
        let mesh = &body.mesh;
        let grid = mesh.lattice.grid();
        let section = loaded.scene.chainmail.clone().unwrap_or_default();
        let table = section.table(&loaded.file, &loaded.scene.tissue)?;
        let mut materials = vec![NO_MATERIAL; grid.len()];
        for (&element, &hu) in mesh.lattice_index.iter().zip(&mesh.hu) {
            // Tissue is at or above `tissue.air_below_hu`, and the first material begins there or below.
            materials[element as usize] = table.at(hu).unwrap_or_default();
        }
        let blame = || loaded.blame("chainmail");
        let mut chain = Chain::new(grid.shape, grid.affine.spacing_mm(), table.materials(), materials)
            .map_err(|error| blame()(Error::Chain(error)))?;
        let linked = linked(mesh, &body.removed.edges);
        chain.cut(|_, a, b| linked[a as usize] & axis_bit(b - a, grid.shape) == 0);
        let handles = handles(loaded, body)?;
        let mut fixed = body.fixed(loaded)?;
        let grabbed = handles.iter().flat_map(|handle| &handle.elements);
        let vertex_of = mesh.vertex_of_point();
        grabbed.for_each(|&element| fixed[vertex_of[element as usize] as usize] = false);
        let elements = mesh.lattice_index.clone();
        let held: Vec<u32> =
            elements.iter().zip(&fixed).filter(|(_, fixed)| **fixed).map(|(element, _)| *element).collect();
        chain.fix(&held).map_err(|error| blame()(Error::Chain(error)))?;
        let cuts = cuts(loaded, body);
        let still = (0..fixed.len()).filter(|&vertex| fixed[vertex] && !body.is_removed(vertex as u32));
        let relax_per_frame = section.relax_per_frame;
        Ok(Self { chain, elements, handles, cuts, fixed: still.count(), relax_per_frame })
    }
}

impl ChainmailSection {
    /// The materials, which must begin where tissue does.
    pub(crate) fn table(&self, file: &Path, tissue: &TissueSection) -> Result<MaterialTable, Error> {
        let (table, value) = match &self.materials {
            MaterialsChoice::Preset(name) => (MaterialTable::preset(name), format!("{name:?}")),
            MaterialsChoice::List(list) => {
                let entries: Vec<_> = list.iter().map(|entry| (entry.from_hu, entry.into())).collect();
                (MaterialTable::new(&entries), String::new())
            }
        };
        let key = "chainmail.materials";
        let wrong = |key: String, value: String, why| Error::SceneKey { file: file.into(), key, value, why };
        let table = table.map_err(|error| match error {
            ChainError::Material { material, key: field, value, range } => {
                let field = if field == "k" { "k_steps" } else { field };
                wrong(format!("{key}[{material}].{field}"), format!("{value:?}"), format!("must be {range}"))
            }
            ChainError::TableOrder { entry, from_hu } => {
                let why = "must be a finite number above that of the material before";
                wrong(format!("{key}[{entry}].from_hu"), format!("{from_hu:?}"), why.into())
            }
            other => wrong(key.into(), value.clone(), other.to_string()),
        })?;
        let (lowest, air) = (table.lowest_hu(), tissue.air_below_hu);
        if lowest > air {
            return Err(wrong(
                key.into(),
                value,
                format!(
                    "the first material begins at {lowest} HU; it must begin where tissue does or below \
                 (tissue.air_below_hu = {air})"
                ),
            ));
        }
        Ok(table)
    }
}

impl From<&ChainMaterialSection> for Material {
    fn from(section: &ChainMaterialSection) -> Self {
        let ChainMaterialSection { shortest, longest, shear, k_steps, from_hu: _ } = *section;
        Self { shortest: shortest.values(), longest: longest.values(), shear: shear.values(), k: k_steps }
    }
}

/// By lattice point: the links to the points after it that are an edge of the body before it was cut.
fn linked(mesh: &TetMesh, taken: &[[u32; 2]]) -> Vec<u8> {
    let grid = mesh.lattice.grid();
    let mut linked = vec![0_u8; grid.len()];
    for [a, b] in mesh.edges.iter().chain(taken).filter_map(|edge| along_axis(mesh, edge)) {
        linked[a as usize] |= axis_bit(b - a, grid.shape);
    }
    linked
}

/// The lattice points of an edge, the one before first, if it lies along an axis.
fn along_axis(mesh: &TetMesh, edge: &[u32; 2]) -> Option<[u32; 2]> {
    let [p, q] = edge.map(|vertex| mesh.point(vertex));
    let apart = (0..3).filter(|&axis| p[axis] != q[axis]).count();
    let [a, b] = edge.map(|vertex| mesh.lattice_index[vertex as usize]);
    (apart == 1).then(|| [a.min(b), a.max(b)])
}

/// The axis of two neighbors whose numbers are so far apart, as a bit. A lattice has two points along each axis at least.
fn axis_bit(apart: u32, [nx, ny, _]: [usize; 3]) -> u8 {
    match apart as usize {
        1 => 1,
        apart if apart == nx => 2,
        apart if apart == nx * ny => 4,
        _ => 0,
    }
}

/// What the handles of the scene grab.
fn handles(loaded: &LoadedScene, body: &Body) -> Result<Vec<ChainHandle>, Error> {
    let mesh = &body.mesh;
    let affine = &mesh.lattice.grid().affine;
    let mut taken = HashMap::new();
    let mut handles = Vec::new();
    for (n, handle) in loaded.scene.handle.iter().enumerate() {
        let wrong = |why: String| Error::SceneKey {
            file: loaded.file.clone(),
            key: format!("handle[{n}].at_mm"),
            value: format!("{:?}", handle.at_mm),
            why,
        };
        let center = mesh.frame.to_local(Point3::from(handle.at_mm)).map(f64::from);
        let near =
            |&v: &u32| distance(&mesh.positions[v as usize].cast(), &center) <= handle.radius_mm / 1000.0;
        let elements: Vec<u32> = (0..mesh.positions.len() as u32)
            .filter(|v| !body.is_removed(*v) && near(v))
            .map(|v| mesh.lattice_index[v as usize])
            .collect();
        if elements.is_empty() {
            return Err(wrong(format!("there is no tissue within radius_mm = {} of it", handle.radius_mm)));
        }
        if let Some(other) = elements.iter().find_map(|&element| taken.insert(element, n)) {
            return Err(wrong(format!("it grabs what handle[{other}] grabs already")));
        }
        let steps = affine.to_index(Vector3::from(handle.move_mm).into()) - affine.to_index(Point3::origin());
        let reaches = |&element: &u32| {
            let rest = mesh.lattice.grid().point(element as usize);
            (0..3).all(|axis| (rest[axis] as f64 + steps[axis]).abs() <= FARTHEST_STEPS)
        };
        if !elements.iter().all(reaches) {
            return Err(Error::SceneKey {
                file: loaded.file.clone(),
                key: format!("handle[{n}].move_mm"),
                value: format!("{:?}", handle.move_mm),
                why: format!("must end within {FARTHEST_STEPS} steps of where the lattice begins"),
            });
        }
        handles.push(ChainHandle { elements, steps, over_s: handle.over_s });
    }
    Ok(handles)
}

/// What each incision cuts: the links that no tet has any more. A tet goes with the first incision that takes it.
fn cuts(loaded: &LoadedScene, body: &Body) -> Vec<ChainCut> {
    let mesh = &body.mesh;
    let slits = loaded.scene.incision.iter().zip(&body.cut.slits);
    let mut slits: Vec<(f64, &Slit)> = slits.map(|(cut, slit)| (cut.at_s, slit)).collect();
    slits.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let mut cuts: Vec<ChainCut> =
        slits.iter().map(|&(at_s, _)| ChainCut { at_s, links: Vec::new() }).collect();
    let mut gone_with = HashMap::new();
    for tet in &body.removed.tets {
        let corners = tet.map(|vertex| mesh.positions[vertex as usize]);
        let Some(cut) = slits.iter().position(|(_, slit)| slit.cuts(&corners)) else { continue };
        for (a, &p) in tet.iter().enumerate() {
            for &q in &tet[a + 1..] {
                let last = gone_with.entry([p.min(q), p.max(q)]).or_insert(cut);
                *last = cut.max(*last);
            }
        }
    }
    for edge in &body.removed.edges {
        if let (Some(link), Some(&cut)) = (along_axis(mesh, edge), gone_with.get(edge)) {
            cuts[cut].links.push(link);
        }
    }
    cuts
}
