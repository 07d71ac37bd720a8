//! The literal rule of the paper: a tet with exactly one air corner gives the triangle of its other
//! three corners.

use rayon::prelude::*;

use crate::Lattice;
use crate::cells::CornerBits;
use crate::surface::{FACES, step};

/// Counts of tets by their number of air corners.
pub(super) struct AirCorners {
    /// Number of tets with 0, 1, 2, 3 and 4 air corners.
    pub air_vertex_histogram: [usize; 5],
}

pub(super) fn count(lattice: &Lattice, tissue: &[bool]) -> AirCorners {
    let [_, cy, cz] = lattice.cells();
    let corners = CornerBits::new(lattice, tissue);
    let layer = |k: usize| {
        let mut histogram = [0usize; 5];
        for j in 0..cy {
            corners.for_row(j, k, |i, bits| {
                let tets = &lattice.stencil().air_corners[(i + j + k) & 1][usize::from(!bits)];
                (0..5).for_each(|air| histogram[air] += usize::from(tets[air]));
            });
        }
        histogram
    };
    let add = |a: [usize; 5], b: [usize; 5]| std::array::from_fn(|n| a[n] + b[n]);
    AirCorners { air_vertex_histogram: (0..cz).into_par_iter().map(layer).reduce(|| [0; 5], add) }
}

/// The triangles of the literal rule, each once. If two tets give the same triangle, the first tet
/// in lattice order sets its orientation.
pub(super) fn triangles(lattice: &Lattice, tissue: &[bool]) -> Vec<[u32; 3]> {
    let (grid, cells, stencil) = (lattice.grid(), lattice.cells(), lattice.stencil());
    let corners = CornerBits::new(lattice, tissue);
    let layer = |k: usize| {
        let mut out = Vec::new();
        for j in 0..cells[1] {
            corners.for_row(j, k, |i, bits| {
                let parity = (i + j + k) & 1;
                if stencil.air_corners[parity][usize::from(!bits)][1] == 0 {
                    return;
                }
                let cell = [i, j, k];
                for (t, tet) in stencil.tets[parity].iter().enumerate() {
                    let mut air = (0..4).filter(|&v| bits >> tet[v] & 1 == 0);
                    let (Some(f), None) = (air.next(), air.next()) else { continue };
                    let neighbor = &stencil.neighbors[parity][t][f];
                    let found_before = step(cell, neighbor, cells).is_some_and(|other| {
                        let opposite = grid.index(Lattice::corner(other, neighbor.opposite));
                        !tissue[opposite]
                            && (grid.index(other), usize::from(neighbor.tet)) < (grid.index(cell), t)
                    });
                    if !found_before {
                        // The air corner is on the side of this tet, so the face is oriented
                        // towards it.
                        let [a, b, c] = FACES[f].map(|v| grid.index(Lattice::corner(cell, tet[v])) as u32);
                        out.push([a, c, b]);
                    }
                }
            });
        }
        out
    };
    (0..cells[2]).into_par_iter().flat_map_iter(layer).collect()
}
