//! A block of cubes cut into six tetrahedra each (Kuhn), with its colors in closed form. Shared by
//! tests and benches. It does not use volumes, so that solver tests do not depend on the way meshes
//! are made from scans.

use nalgebra::Point3;

/// Steps of the edges: along the axes, across the faces, through the cube.
const DIRECTIONS: [[usize; 3]; 7] =
    [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [0, 1, 1], [1, 0, 1], [1, 1, 1]];
/// Orders of the axes along which the corners of a tetrahedron go from the lowest to the highest
/// corner of the cube. The even permutations, whose tetrahedra are positively oriented, come before
/// the odd ones.
const WALKS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [1, 0, 2], [2, 1, 0]];

/// Vertices in rows along x, then y, then z.
pub struct Kuhn {
    /// In meters, from the origin.
    pub positions: Vec<Point3<f64>>,
    /// Two vertices each.
    pub edges: Vec<[u32; 2]>,
    /// Direction × parity along the last axis of the direction: 14 colors.
    pub edge_colors: Vec<u16>,
    /// Four vertices each, positively oriented.
    pub tets: Vec<[u32; 4]>,
    /// Walk × parity of the cube along the middle axis of the walk × parity of the sum along the
    /// other two: 24 colors.
    pub tet_colors: Vec<u16>,
}

impl Kuhn {
    /// `size` vertices along each axis, `spacing` meters apart.
    pub fn new(size: [usize; 3], spacing: f64) -> Self {
        let points = || cells(size);
        let index = |p: [usize; 3]| (p[0] + size[0] * (p[1] + size[1] * p[2])) as u32;
        let inside = |p: &[usize; 3]| (0..3).all(|axis| p[axis] < size[axis]);
        let mut lattice = Self {
            positions: points().map(|p| Point3::from(p.map(|n| n as f64 * spacing))).collect(),
            edges: Vec::new(),
            edge_colors: Vec::new(),
            tets: Vec::new(),
            tet_colors: Vec::new(),
        };
        for p in points() {
            for (direction, d) in DIRECTIONS.iter().enumerate() {
                let end = [p[0] + d[0], p[1] + d[1], p[2] + d[2]];
                let axis = d.iter().rposition(|&step| step == 1).unwrap_or(0);
                if inside(&end) {
                    lattice.edges.push([index(p), index(end)]);
                    lattice.edge_colors.push((direction * 2 + p[axis] % 2) as u16);
                }
            }
        }
        for p in cells(size.map(|n| n - 1)) {
            for (walk, axes) in WALKS.iter().enumerate() {
                let mut corner = p;
                let mut tet = [index(p); 4];
                for (place, &axis) in tet[1..].iter_mut().zip(axes) {
                    corner[axis] += 1;
                    *place = index(corner);
                }
                if walk >= 3 {
                    tet.swap(1, 2);
                }
                lattice.tets.push(tet);
                let (middle, ends) = (p[axes[1]] % 2, (p[axes[0]] + p[axes[2]]) % 2);
                lattice.tet_colors.push((walk * 4 + 2 * middle + ends) as u16);
            }
        }
        lattice
    }
}

/// All index triples below `size`, x fastest.
fn cells([nx, ny, nz]: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (0..nz).flat_map(move |k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k])))
}
