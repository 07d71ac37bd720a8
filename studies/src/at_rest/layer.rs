//! Skin on an elastic layer in plane strain, solved without any code of the product: a closed form
//! for a thin layer, the exact decay of the far field, and finite elements.

/// A layer of soft tissue on firm ground, with skin on top. A cut through the skin and the layer
/// ends both at `s = 0`. The skin pulls its end away from the cut.
#[derive(Clone, Copy, Debug)]
pub struct Layer {
    /// Thickness `h` of the layer in m.
    pub thickness: f64,
    /// Shear modulus `G` of the layer in Pa.
    pub shear_modulus: f64,
    /// Poisson's ratio of the layer, above 0.25 and below 0.5.
    pub poisson: f64,
    /// Modulus `T` of the skin in N/m.
    pub skin_modulus: f64,
    /// Tension `τ` of the skin in N/m.
    pub tension: f64,
}

impl Layer {
    /// The length `λ = √(T h/G)` of shear lag in m. It is that of a layer much thinner than `λ`.
    pub fn lag_length(&self) -> f64 {
        (self.skin_modulus * self.thickness / self.shear_modulus).sqrt()
    }

    /// Displacement of the skin by shear lag, `τ λ/T e^(−s/λ)` in m, at the distance `s` in m from
    /// the cut. In this form the layer has only shear, which is the same at every depth.
    pub fn lag(&self, distance: f64) -> f64 {
        let length = self.lag_length();
        self.tension * length / self.skin_modulus * (-distance / length).exp()
    }

    /// First Lamé modulus in Pa.
    pub fn lame(&self) -> f64 {
        2.0 * self.shear_modulus * self.poisson / (1.0 - 2.0 * self.poisson)
    }

    /// The length in m over which the displacement far from the cut falls by the factor `e`, for
    /// any thickness.
    ///
    /// With the height `z` above the ground and `θ = κ z`, the fields `e^(−κ x) (U(θ), W(θ))` with
    ///
    /// ```text
    /// U = b₁ (χ sin θ + θ cos θ) + b₂ θ sin θ
    /// W = b₁ θ sin θ + b₂ (χ sin θ − θ cos θ)            χ = 3 − 4ν
    /// ```
    ///
    /// solve the equations of plane strain and vanish at the ground (Papkovich and Neuber). On top
    /// the normal stress is zero, and the shear stress is that of the skin, `T κ² U`. Both hold for
    /// some `b₁` and `b₂` if their determinant is zero. The smallest such `κ` is the inverse of the
    /// length.
    pub fn decay_length(&self) -> f64 {
        let determinant = |kappa: f64| {
            let theta = kappa * self.thickness;
            let ((sin, cos), chi) = (theta.sin_cos(), 3.0 - 4.0 * self.poisson);
            let along = [chi * sin + theta * cos, theta * sin];
            let up = [theta * sin, chi * sin - theta * cos];
            let along_by_theta = [(chi + 1.0) * cos - theta * sin, sin + theta * cos];
            let up_by_theta = [sin + theta * cos, (chi - 1.0) * cos + theta * sin];
            let wave = self.lame() + 2.0 * self.shear_modulus;
            let normal = [0, 1].map(|n| wave * up_by_theta[n] - self.lame() * along[n]);
            let shear = [0, 1].map(|n| {
                let layer = self.shear_modulus * (along_by_theta[n] - up[n]);
                self.skin_modulus * kappa * along[n] - layer
            });
            normal[0] * shear[1] - normal[1] * shear[0]
        };
        let step = 1e-3 / self.lag_length();
        let mut low = step;
        while determinant(low + step) * determinant(low) > 0.0 {
            low += step;
        }
        let (below, mut high) = (determinant(low), low + step);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if determinant(middle) * below > 0.0 { low = middle } else { high = middle }
        }
        1.0 / low
    }

    /// Displacement of the skin in m at `0, d, 2d, …` from the cut, with `d` the thickness over
    /// `rows`, by square bilinear finite elements. The far end, `columns` elements from the cut, is
    /// fixed.
    pub fn elements(&self, columns: usize, rows: usize) -> Vec<f64> {
        let size = self.thickness / rows as f64;
        let number = |column: usize, row: usize, axis: usize| 2 * (column * rows + row - 1) + axis;
        let mut matrix = Banded::new(2 * columns * rows, 2 * rows + 4);
        let element = self.element();
        for column in 0..columns {
            for row in 0..rows {
                let unknown = |n: usize| {
                    let (i, k) = (column + (n / 2) % 2, row + n / 4);
                    (i < columns && k > 0).then(|| number(i, k, n % 2))
                };
                for (a, values) in element.iter().enumerate() {
                    for (b, value) in values.iter().enumerate() {
                        if let (Some(a), Some(b)) = (unknown(a), unknown(b)) {
                            matrix.add(a, b, *value);
                        }
                    }
                }
            }
            let skin = self.skin_modulus / size;
            let [here, next] = [number(column, rows, 0), number(column + 1, rows, 0)];
            matrix.add(here, here, skin);
            if column + 1 < columns {
                matrix.add(next, next, skin);
                matrix.add(here, next, -skin);
                matrix.add(next, here, -skin);
            }
        }
        let mut load = vec![0.0; 2 * columns * rows];
        load[number(0, rows, 0)] = self.tension;
        let moved = matrix.solve(load);
        (0..columns).map(|column| moved[number(column, rows, 0)]).chain([0.0]).collect()
    }

    /// Stiffness of a square element per width, in Pa. The unknowns are the displacements along x
    /// and z of the corners (0, 0), (1, 0), (0, 1) and (1, 1). The matrix does not depend on the
    /// size of the square.
    fn element(&self) -> [[f64; 8]; 8] {
        let (lame, shear) = (self.lame(), self.shear_modulus);
        let mut stiffness = [[0.0; 8]; 8];
        let points = [0.5 - 0.5 / 3f64.sqrt(), 0.5 + 0.5 / 3f64.sqrt()];
        for (x, z) in points.into_iter().flat_map(|x| points.map(|z| (x, z))) {
            let slopes = [[z - 1.0, x - 1.0], [1.0 - z, -x], [-z, 1.0 - x], [z, x]];
            for (a, b) in (0..8).flat_map(|a| (0..8).map(move |b| (a, b))) {
                let ([p, q], [i, j]) = ([slopes[a / 2], slopes[b / 2]], [a % 2, b % 2]);
                let same = if i == j { p[0] * q[0] + p[1] * q[1] } else { 0.0 };
                stiffness[a][b] += 0.25 * (lame * p[i] * q[j] + shear * (p[j] * q[i] + same));
            }
        }
        stiffness
    }
}

/// A symmetric positive definite matrix whose entries lie near the diagonal.
struct Banded {
    width: usize,
    /// The entries from the diagonal leftwards, row by row.
    rows: Vec<Vec<f64>>,
}

impl Banded {
    fn new(size: usize, width: usize) -> Self {
        Self { width, rows: vec![vec![0.0; width]; size] }
    }

    /// Adds to an entry. Entries above the diagonal are those below.
    fn add(&mut self, row: usize, column: usize, value: f64) {
        if column <= row {
            self.rows[row][row - column] += value;
        }
    }

    /// Solves the equations by Cholesky's method.
    fn solve(mut self, mut x: Vec<f64>) -> Vec<f64> {
        let size = x.len();
        for row in 0..size {
            let first = (row + 1).saturating_sub(self.width);
            for column in first..=row {
                let start = first.max((column + 1).saturating_sub(self.width));
                let [left, above] = [&self.rows[row], &self.rows[column]];
                let sum: f64 = (start..column).map(|k| left[row - k] * above[column - k]).sum();
                let rest = left[row - column] - sum;
                self.rows[row][row - column] = if column == row { rest.sqrt() } else { rest / above[0] };
            }
            let sum: f64 = (first..row).map(|k| self.rows[row][row - k] * x[k]).sum();
            x[row] = (x[row] - sum) / self.rows[row][0];
        }
        for row in (0..size).rev() {
            x[row] /= self.rows[row][0];
            for column in (row + 1).saturating_sub(self.width)..row {
                x[column] -= self.rows[row][row - column] * x[row];
            }
        }
        x
    }
}
