//! A sheet of springs and skin triangles on the equilateral lattice, whose moduli are known in
//! closed form.
//!
//! Springs of stiffness `k` between neighbors give the sheet `E = 2k/√3`, `ν = 1/3`, `K₂ =
//! (√3/2)k`, `μ = (√3/4)k` (all in N/m); an area stiffness `k_A` on each triangle adds `k_A·A0` to
//! `K₂`.

use std::collections::HashMap;

use nalgebra::Point3;

/// Distance of two rows of vertices: the height of a triangle with sides of length 1.
pub const ROW: f64 = 0.866_025_403_784_438_6;

/// Vertices, springs and triangles of a sheet in the plane z = 0, in units of the spacing.
pub struct Sheet {
    /// Positions `(i + ½(j mod 2), j·√3/2)` with column `i` and row `j` from the middle.
    pub positions: Vec<Point3<f64>>,
    /// Column and row of each vertex.
    pub places: Vec<[i64; 2]>,
    /// Springs, two vertices each.
    pub springs: Vec<[u32; 2]>,
    /// Triangles, three vertices each.
    pub triangles: Vec<[u32; 3]>,
    /// True for fixed vertices: the outermost columns and rows.
    pub held: Vec<bool>,
}

impl Sheet {
    /// A sheet of `nx` columns. The number of rows is even and makes it about as high as wide.
    pub fn new(nx: i64) -> Self {
        let ny = ((nx as f64 * 2.0 / 3f64.sqrt()).floor() as i64 + 1) / 2 * 2;
        let mut numbers = HashMap::new();
        let (mut places, mut positions, mut held) = (Vec::new(), Vec::new(), Vec::new());
        for j in -ny / 2..=ny / 2 {
            for i in -nx / 2..=nx / 2 {
                numbers.insert([i, j], places.len() as u32);
                let x = i as f64 + 0.5 * j.rem_euclid(2) as f64;
                positions.push(Point3::new(x, j as f64 * ROW, 0.0));
                held.push(x.abs() > nx as f64 / 2.0 - 1.2 || j.abs() == ny / 2);
                places.push([i, j]);
            }
        }
        let (mut springs, mut triangles) = (Vec::new(), Vec::new());
        for (vertex, &[i, j]) in places.iter().enumerate() {
            let vertex = vertex as u32;
            let odd = j.rem_euclid(2);
            let right = numbers.get(&[i + 1, j]);
            let up_left = numbers.get(&[i - 1 + odd, j + 1]);
            let up_right = numbers.get(&[i + odd, j + 1]);
            springs.extend([right, up_left, up_right].into_iter().flatten().map(|&n| [vertex, n]));
            if let (Some(&b), Some(&c)) = (right, up_right) {
                triangles.push([vertex, b, c]);
            }
            if let (Some(&b), Some(&c)) = (up_right, up_left) {
                triangles.push([vertex, b, c]);
            }
        }
        Self { positions, places, springs, triangles, held }
    }

    /// Cuts a slit of half-length `a` between rows 0 and 1.
    pub fn cut(mut self, a: f64) -> Self {
        let crosses = |&u: &u32, &v: &u32| {
            let (x, y) = (u as usize, v as usize);
            let rows = [self.places[x][1], self.places[y][1]];
            let middle = (self.positions[x].x + self.positions[y].x) / 2.0;
            (rows == [0, 1] || rows == [1, 0]) && middle.abs() <= a
        };
        self.springs.retain(|[u, v]| !crosses(u, v));
        self.triangles.retain(|[u, v, w]| !(crosses(u, v) || crosses(v, w) || crosses(w, u)));
        self
    }

    /// Mean opening of the slit in its middle: displacement of the upper lip minus displacement of
    /// the lower lip.
    pub fn opening(&self, positions: &[Point3<f64>]) -> f64 {
        let lip = |row: i64| {
            let near = |&v: &usize| self.places[v][1] == row && self.positions[v].x.abs() <= 0.51;
            let lip: Vec<usize> = (0..self.positions.len()).filter(near).collect();
            lip.iter().map(|&v| positions[v].y - self.positions[v].y).sum::<f64>() / lip.len() as f64
        };
        lip(1) - lip(0)
    }
}
