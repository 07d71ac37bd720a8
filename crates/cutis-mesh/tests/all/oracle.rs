//! Slow and simple reference implementations, and helpers that several tests share.

use std::collections::{BTreeMap, BTreeSet};

use cutis_mesh::{Cut, Incision, Lattice, MeshError, Skin, Slit, Split, TetMesh, Tissue, TissueMask};
use cutis_volume::{Affine, Grid};
use proptest::prelude::*;

/// A lattice with the given steps. A negative step mirrors an axis.
pub fn lattice(shape: [usize; 3], step_mm: [f64; 3], split: Split) -> Lattice {
    let affine = Affine::from_spacing(step_mm, [30.0, -20.0, 10.0]).unwrap();
    Lattice::new(Grid { shape, affine }, split).unwrap()
}

/// Air flags from a condition on the positions of the lattice points.
pub fn air(lattice: &Lattice, is_tissue: impl Fn([f64; 3]) -> bool) -> Vec<bool> {
    let grid = lattice.grid();
    (0..grid.len()).map(|point| !is_tissue(grid.mm(grid.point(point)).into())).collect()
}

/// The mesh of all tissue, or of its largest component.
pub fn build(
    lattice: &Lattice,
    hu: &[f32],
    air: &[bool],
    largest_component: bool,
) -> Result<TetMesh, MeshError> {
    TissueMask::find(lattice, &Tissue { air, cut_away: &[], largest_component })?.mesh(hu)
}

/// The mesh of all tissue, at 40 HU.
pub fn mesh(lattice: &Lattice, air: &[bool]) -> TetMesh {
    build(lattice, &vec![40.0; air.len()], air, false).unwrap()
}

/// The skin triangles in vertices of a mesh, and the number of triangles with points outside the
/// mesh.
pub fn skin_on_mesh(mesh: &TetMesh, skin: &Skin) -> (Vec<[u32; 3]>, usize) {
    let is_vertex = |point: &u32| mesh.lattice_index.binary_search(point).is_ok();
    let on_mesh: Vec<[u32; 3]> =
        skin.triangles.iter().filter(|triangle| triangle.iter().all(is_vertex)).copied().collect();
    (mesh.divide_skin(&on_mesh).0, skin.triangles.len() - on_mesh.len())
}

/// Places incisions on the skin of a mesh (mesh vertices) and plans their cut.
pub fn plan(mesh: &TetMesh, triangles: &[[u32; 3]], incisions: &[Incision]) -> Result<Cut, MeshError> {
    let skin: Vec<[u32; 3]> = triangles.iter().map(|t| t.map(|v| mesh.lattice_index[v as usize])).collect();
    Cut::of_slits(mesh, triangles, Slit::on_lattice(&mesh.lattice, &skin, incisions)?)
}

/// Every tet of a lattice, in flat indices.
pub fn all_tets(lattice: &Lattice) -> Vec<[usize; 4]> {
    let [cx, cy, cz] = lattice.cells();
    let mut tets = Vec::new();
    for k in 0..cz {
        for j in 0..cy {
            for i in 0..cx {
                for tet in lattice.cell_tets(i, j, k) {
                    tets.push(tet.map(|corner| lattice.grid().index(Lattice::corner([i, j, k], corner))));
                }
            }
        }
    }
    tets
}

pub fn sorted<const N: usize>(mut simplex: [usize; N]) -> [usize; N] {
    simplex.sort_unstable();
    simplex
}

/// The tets of each face, each with its corner opposite to the face.
pub fn tets_of_faces(tets: &[[usize; 4]]) -> BTreeMap<[usize; 3], Vec<(usize, usize)>> {
    let mut faces: BTreeMap<_, Vec<_>> = BTreeMap::new();
    for (n, tet) in tets.iter().enumerate() {
        for f in 0..4 {
            let mut face = tet.to_vec();
            let opposite = face.remove(f);
            faces.entry(sorted([face[0], face[1], face[2]])).or_default().push((n, opposite));
        }
    }
    faces
}

/// The set of sorted triangles.
pub fn set(triangles: &[[u32; 3]]) -> BTreeSet<[usize; 3]> {
    triangles.iter().map(|t| sorted(t.map(|v| v as usize))).collect()
}

/// Directed edges with their number of occurrences.
pub fn directed_edges(triangles: &[[u32; 3]]) -> BTreeMap<[u32; 2], usize> {
    let mut edges = BTreeMap::new();
    for &[a, b, c] in triangles {
        for edge in [[a, b], [b, c], [c, a]] {
            *edges.entry(edge).or_default() += 1;
        }
    }
    edges
}

/// Random lattices of 2 to 5 points per axis, with both splits and handednesses and random air.
pub fn random_body() -> impl Strategy<Value = (Lattice, Vec<bool>)> {
    let shape = [2..6usize, 2..6usize, 2..6usize];
    (shape, any::<bool>(), any::<bool>(), 0.05..0.95f64).prop_flat_map(|(shape, five, mirrored, share)| {
        let split = if five { Split::Five } else { Split::Kuhn6 };
        let lattice = lattice(shape, [if mirrored { -2.0 } else { 2.0 }, 3.0, 2.5], split);
        let air = proptest::collection::vec(proptest::bool::weighted(share), lattice.grid().len());
        (Just(lattice), air)
    })
}
