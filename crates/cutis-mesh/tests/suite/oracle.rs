//! Slow and plain: tets enumerated one by one, faces matched in maps. And small scenes for the other tests.

use std::collections::{BTreeMap, BTreeSet};

use cutis_mesh::{Lattice, Split, TetMesh, Tissue};
use cutis_volume::{Affine, Grid};
use proptest::prelude::*;

/// A lattice with the given steps, mirrored where a step is negative.
pub fn lattice(shape: [usize; 3], step_mm: [f64; 3], split: Split) -> Lattice {
    let affine = Affine::from_spacing(step_mm, [30.0, -20.0, 10.0]).unwrap();
    Lattice::new(Grid { shape, affine }, split).unwrap()
}

/// Air flags from a test of the lattice points.
pub fn air(lattice: &Lattice, is_tissue: impl Fn([f64; 3]) -> bool) -> Vec<bool> {
    let grid = lattice.grid();
    (0..grid.len()).map(|point| !is_tissue(grid.mm(grid.point(point)).into())).collect()
}

/// A mesh of everything that is not air, at 40 HU.
pub fn mesh(lattice: &Lattice, air: &[bool]) -> TetMesh {
    let tissue = Tissue { air, cut_away: &[], largest_component: false };
    TetMesh::build(lattice, &vec![40.0; air.len()], &tissue).unwrap()
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

/// Face → the tets that have it, each with its corner opposite to the face.
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

/// Sorted triangles.
pub fn set(triangles: &[[u32; 3]]) -> BTreeSet<[usize; 3]> {
    triangles.iter().map(|t| sorted(t.map(|v| v as usize))).collect()
}

/// Directed edges, each with how often it occurs.
pub fn directed_edges(triangles: &[[u32; 3]]) -> BTreeMap<[u32; 2], usize> {
    let mut edges = BTreeMap::new();
    for &[a, b, c] in triangles {
        for edge in [[a, b], [b, c], [c, a]] {
            *edges.entry(edge).or_default() += 1;
        }
    }
    edges
}

/// Lattices of up to 6 points per axis, both splits and handednesses, with random air.
pub fn random_body() -> impl Strategy<Value = (Lattice, Vec<bool>)> {
    let shape = [2..6usize, 2..6usize, 2..6usize];
    (shape, any::<bool>(), any::<bool>(), 0.05..0.95f64).prop_flat_map(|(shape, five, mirrored, share)| {
        let split = if five { Split::Five } else { Split::Kuhn6 };
        let lattice = lattice(shape, [if mirrored { -2.0 } else { 2.0 }, 3.0, 2.5], split);
        let air = proptest::collection::vec(proptest::bool::weighted(share), lattice.grid().len());
        (Just(lattice), air)
    })
}
