//! The solids of the anatomy as signed distances in mm (negative inside), evaluated along rows of
//! sample points.
//!
//! Ellipsoids and outlines use the first-order distance `(q − 1)/|∇q|` of their gauge `q`. It is
//! exact on the surface and close to the true distance near it. The distances of capsules and the
//! board are exact.

use super::outline::Outline;

/// An axis-aligned box in mm.
#[derive(Clone, Copy)]
pub(super) struct Bounds {
    pub(super) low: [f32; 3],
    pub(super) high: [f32; 3],
}

impl Bounds {
    /// True if `value` is at most `margin` outside the box along `axis`.
    pub(super) fn covers(&self, axis: usize, value: f32, margin: f32) -> bool {
        value >= self.low[axis] - margin && value <= self.high[axis] + margin
    }
}

/// A solid of any kind.
pub(super) enum Solid {
    Blob(Blob),
    Capsule(Capsule),
    Outline(Outline),
    Board(Board),
}

impl Solid {
    pub(super) fn bounds(&self) -> Bounds {
        match self {
            Self::Blob(blob) => blob.bounds(),
            Self::Capsule(capsule) => capsule.bounds(),
            Self::Outline(outline) => outline.bounds(),
            Self::Board(board) => board.bounds(),
        }
    }

    /// Lowers each `distance` to the signed distance of this solid at `(x, y, z)`.
    pub(super) fn lower_row(&self, xs: &[f32], y: f32, z: f32, distance: &mut [f32]) {
        match self {
            Self::Blob(blob) => blob.lower_row(xs, y, z, distance),
            Self::Capsule(capsule) => capsule.lower_row(xs, y, z, distance),
            Self::Outline(outline) => outline.lower_row(xs, y, z, distance),
            Self::Board(board) => board.lower_row(xs, y, distance),
        }
    }
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn subtract(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(super) fn norm(a: [f32; 3]) -> f32 {
    dot(a, a).sqrt()
}

/// First-order distance to the surface `q = 1`, where `q² = (1 − s) Σu² + s √Σu⁴` blends an
/// ellipsoid (`s = 0`) into a rounded box.
///
/// `gradient` maps the derivative by `u` to the derivative by mm. `inradius` keeps the value
/// defined at the center, where `q` and its gradient vanish.
#[inline(always)]
pub(super) fn gauge_distance(
    u: [f32; 3],
    s: f32,
    inradius: f32,
    gradient: impl Fn([f32; 3]) -> [f32; 3],
) -> f32 {
    const TINY: f32 = 1e-12;
    let squares = u.map(|c| c * c);
    let quartic = dot(squares, squares).sqrt();
    let q = ((1.0 - s) * (squares[0] + squares[1] + squares[2]) + s * quartic).sqrt();
    let bend = s / (quartic + TINY);
    let slope = norm(gradient([0, 1, 2].map(|a| u[a] * (1.0 - s + bend * squares[a]))));
    (q - 1.0) * (q + TINY) / (slope + TINY / inradius)
}

/// An ellipsoid, optionally rotated and blended into a rounded box.
#[derive(Clone, Copy)]
pub(super) struct Blob {
    pub(super) center: [f32; 3],
    radii: [f32; 3],
    axes: [[f32; 3]; 3],
    squareness: f32,
}

impl Blob {
    pub(super) fn new(center: [f32; 3], radii: [f32; 3]) -> Self {
        Self { center, radii, axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], squareness: 0.0 }
    }

    /// Blends the ellipsoid into a rounded box: 0 is the ellipsoid, 1 the superellipsoid of
    /// exponent 4.
    pub(super) fn squared(self, squareness: f32) -> Self {
        Self { squareness, ..self }
    }

    /// Rotates the solid about the coordinate axis `axis`. `half_tangent` is the tangent of half
    /// the angle.
    pub(super) fn turned(mut self, axis: usize, half_tangent: f32) -> Self {
        let scale = 1.0 / (1.0 + half_tangent * half_tangent);
        let (cos, sin) = ((1.0 - half_tangent * half_tangent) * scale, 2.0 * half_tangent * scale);
        let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
        for row in &mut self.axes {
            (row[a], row[b]) = (cos * row[a] - sin * row[b], sin * row[a] + cos * row[b]);
        }
        self
    }

    /// Reduces every radius by `inset`.
    pub(super) fn shrunk(self, inset: f32) -> Self {
        Self { radii: self.radii.map(|r| r - inset), ..self }
    }

    fn bounds(&self) -> Bounds {
        let reach = |c: usize| (0..3).map(|a| self.axes[a][c].abs() * self.radii[a]).sum::<f32>();
        Bounds {
            low: std::array::from_fn(|c| self.center[c] - reach(c)),
            high: std::array::from_fn(|c| self.center[c] + reach(c)),
        }
    }

    fn lower_row(&self, xs: &[f32], y: f32, z: f32, distance: &mut [f32]) {
        let rows: [[f32; 3]; 3] = std::array::from_fn(|a| self.axes[a].map(|c| c / self.radii[a]));
        let base = rows.map(|row| row[1] * (y - self.center[1]) + row[2] * (z - self.center[2]));
        let inradius = self.radii[0].min(self.radii[1]).min(self.radii[2]);
        for (d, &x) in distance.iter_mut().zip(xs) {
            let u: [f32; 3] = std::array::from_fn(|a| base[a] + rows[a][0] * (x - self.center[0]));
            let near = gauge_distance(u, self.squareness, inradius, |h| {
                std::array::from_fn(|c| rows[0][c] * h[0] + rows[1][c] * h[1] + rows[2][c] * h[2])
            });
            *d = d.min(near);
        }
    }
}

/// A round cone between two balls: a segment with a radius that varies linearly along it.
#[derive(Clone, Copy)]
pub(super) struct Capsule {
    ends: [[f32; 3]; 2],
    radii: [f32; 2],
}

impl Capsule {
    pub(super) fn new(ends: [[f32; 3]; 2], radii: [f32; 2]) -> Self {
        Self { ends, radii }
    }

    fn bounds(&self) -> Bounds {
        let [a, b] = self.ends;
        let [r, s] = self.radii;
        Bounds {
            low: std::array::from_fn(|c| (a[c] - r).min(b[c] - s)),
            high: std::array::from_fn(|c| (a[c] + r).max(b[c] + s)),
        }
    }

    fn lower_row(&self, xs: &[f32], y: f32, z: f32, distance: &mut [f32]) {
        let along = subtract(self.ends[1], self.ends[0]);
        // A segment without length acts as a ball. Any finite scale is correct.
        let squared = dot(along, along);
        let scale = if squared > 0.0 { 1.0 / squared } else { 0.0 };
        let (dy, dz) = (y - self.ends[0][1], z - self.ends[0][2]);
        let base = along[1] * dy + along[2] * dz;
        for (d, &x) in distance.iter_mut().zip(xs) {
            let dx = x - self.ends[0][0];
            let t = ((along[0] * dx + base) * scale).clamp(0.0, 1.0);
            let off = [dx - t * along[0], dy - t * along[1], dz - t * along[2]];
            *d = d.min(norm(off) - (self.radii[0] + t * (self.radii[1] - self.radii[0])));
        }
    }
}

/// A curved board: an arc of a cylinder whose axis is parallel to z and above the board.
#[derive(Clone, Copy)]
pub(super) struct Board {
    /// The y coordinate of the upper surface in the middle, in mm.
    pub(super) top: f32,
    pub(super) thickness: f32,
    pub(super) half_width: f32,
    /// Radius of curvature of the middle of the board in mm.
    pub(super) bend: f32,
}

impl Board {
    fn bounds(&self) -> Bounds {
        let w = self.half_width;
        let rise = self.bend - (self.bend * self.bend - w * w).sqrt();
        Bounds {
            low: [-w, self.top - self.thickness, f32::NEG_INFINITY],
            high: [w, self.top + rise, f32::INFINITY],
        }
    }

    fn lower_row(&self, xs: &[f32], y: f32, distance: &mut [f32]) {
        let half = 0.5 * self.thickness;
        let dy = y - (self.top - half + self.bend);
        for (d, &x) in distance.iter_mut().zip(xs) {
            let across = ((x * x + dy * dy).sqrt() - self.bend).abs() - half;
            *d = d.min(across.max(x.abs() - self.half_width));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(solid: &Solid, [x, y, z]: [f32; 3]) -> f32 {
        let mut d = [f32::INFINITY];
        solid.lower_row(&[x], y, z, &mut d);
        d[0]
    }

    #[test]
    fn ball_distances_are_exact() {
        let blob = Solid::Blob(Blob::new([1.0, 2.0, 3.0], [5.0; 3]).turned(2, 0.3));
        let capsule = Solid::Capsule(Capsule::new([[1.0, 2.0, 3.0]; 2], [5.0; 2]));
        for p in [[1.0, 2.0, 3.0], [4.0, 2.0, 3.0], [1.0, 9.0, -3.0], [-20.0, 4.0, 8.0]] {
            let expected = norm(subtract(p, [1.0, 2.0, 3.0])) - 5.0;
            assert!((at(&blob, p) - expected).abs() < 1e-4, "{p:?}: {} not {expected}", at(&blob, p));
            assert!((at(&capsule, p) - expected).abs() < 1e-4);
        }
    }

    #[test]
    fn rotation_moves_the_long_axis() {
        // A rotation by 90° about z (half tangent 1) moves the long axis from x to y.
        let long = Solid::Blob(Blob::new([0.0; 3], [9.0, 2.0, 2.0]));
        let turned = Solid::Blob(Blob::new([0.0; 3], [9.0, 2.0, 2.0]).turned(2, 1.0));
        assert!(at(&long, [8.0, 0.0, 0.0]) < 0.0 && at(&long, [0.0, 8.0, 0.0]) > 0.0);
        assert!(at(&turned, [8.0, 0.0, 0.0]) > 0.0 && at(&turned, [0.0, 8.0, 0.0]) < 0.0);
    }

    #[test]
    fn every_solid_lies_within_its_bounds() {
        let solids = [
            Solid::Blob(
                Blob::new([3.0, -4.0, 5.0], [30.0, 12.0, 20.0]).squared(0.8).turned(0, 0.4).turned(1, -0.7),
            ),
            Solid::Capsule(Capsule::new([[-20.0, 5.0, 5.0], [18.0, -9.0, 2.0]], [6.0, 2.0])),
            Solid::Board(Board { top: -10.0, thickness: 6.0, half_width: 30.0, bend: 60.0 }),
        ];
        for solid in &solids {
            let bounds = solid.bounds();
            let mut inside = 0;
            for n in 0..64_000_u16 {
                let p = [n % 40, n / 40 % 40, n / 1600].map(|c| 2.0 * f32::from(c) - 39.0);
                if at(solid, p) < 0.0 {
                    inside += 1;
                    assert!(
                        (0..3).all(|axis| bounds.covers(axis, p[axis], 1e-3)),
                        "{p:?} is outside the bounds"
                    );
                }
            }
            assert!(inside > 100, "only {inside} points are inside the solid");
        }
    }
}
