//! Which part of a split tetrahedron a point belongs to, and how much of it each part has.
//!
//! Within a tet the wall of a blade is the plane on which the linear interpolation of the blade's
//! distances is zero. Neighboring tets share the distances of their common corners, so the wall is
//! continuous.

use std::cmp::Ordering;

use super::components::count;

/// Barycentric coordinates in a tet.
pub type Barycentric = [f64; 4];

/// The walls in a split tet.
#[derive(Clone, Copy, Debug)]
pub struct Walls<'a> {
    /// Signed distances of the corners in m, for each blade that severs an edge of the tet. At most
    /// [`Walls::MOST`].
    pub distances: &'a [[f32; 4]],
    /// The part of each corner.
    pub parts: [u8; 4],
    /// One bit for each part that has a copy.
    pub kept: u8,
    /// The first of two rows of distances around a piece that is taken out: the piece is where
    /// both are negative.
    pub piece: Option<u8>,
}

/// The side of each blade on which a point is, one bit per blade. Zero is on the positive side.
type Sides = u8;

impl Walls<'_> {
    /// Largest number of blades in a tet.
    pub const MOST: usize = 8;

    /// The part to which a point of the tet belongs.
    ///
    /// It is the part of the corners on the same sides of all blades. Where there is none, because
    /// a blade ends in the tet, the blades count that have each part on one side only. Of several
    /// corners the one with the largest coordinate counts.
    pub fn owner(&self, point: &Barycentric) -> u8 {
        let sides = self.sides(|distances| weighted(distances, point));
        let corners = [0, 1, 2, 3].map(|n| self.sides(|distances| f64::from(distances[n])));
        let dividing = self.dividing(&corners);
        let rank = |n: usize| (sides == corners[n], (sides ^ corners[n]) & dividing == 0);
        let usable = (0..4).filter(|&n| self.kept >> self.parts[n] & 1 == 1);
        let better = |a: &usize, b: &usize| {
            rank(*a).cmp(&rank(*b)).then(point[*a].total_cmp(&point[*b])).then(b.cmp(a))
        };
        usable.max_by(better).map_or(0, |n| self.parts[n])
    }

    /// As [`Walls::owner`], but None where the piece that is taken out lies between two walls in
    /// the tet and none of the corners is in it. There the piece is thinner than the tet.
    pub fn holder(&self, point: &Barycentric) -> Option<u8> {
        let out = |row: u8| {
            let is_inside = |sides: Sides| sides >> row & 0b11 == 0;
            let at_corner = |n: usize| self.sides(|distances| f64::from(distances[n]));
            is_inside(self.sides(|distances| weighted(distances, point)))
                && !(0..4).any(|n| is_inside(at_corner(n)))
        };
        (!self.piece.is_some_and(out)).then(|| self.owner(point))
    }

    /// Share of the tet's volume that each part has. What lies between two walls and has no corner
    /// counts with a part next to it. The shares of the kept parts sum to 1.
    pub fn volumes(&self) -> [f64; 4] {
        let unit = |n: usize| std::array::from_fn(|axis| f64::from(u8::from(axis == n)));
        let corners: [Barycentric; 4] = [unit(0), unit(1), unit(2), unit(3)];
        self.shares(corners, |piece| determinant(piece).abs())
    }

    /// Share of the area of the face opposite to a corner that each part has.
    pub fn areas(&self, opposite: usize) -> [f64; 4] {
        let unit = |n: usize| std::array::from_fn(|axis| f64::from(u8::from(axis == n)));
        let [a, b, c] = [1, 2, 3].map(|step| (opposite + step) % 4);
        self.shares([unit(a), unit(b), unit(c)], |piece| {
            let of = |n: usize| [piece[n][a], piece[n][b], piece[n][c]];
            let ([p, q, r], [s, t, u], [v, w, x]) = (of(0), of(1), of(2));
            (p * (t * x - u * w) - q * (s * x - u * v) + r * (s * w - t * v)).abs()
        })
    }

    fn shares<const N: usize>(
        &self,
        simplex: [Barycentric; N],
        size: impl Fn(&[Barycentric; N]) -> f64,
    ) -> [f64; 4] {
        let mut shares = [0.0; 4];
        self.divided(simplex, |middle, piece| shares[usize::from(self.owner(middle))] += size(piece));
        shares
    }

    /// Divides a simplex along the walls and calls `visit(part, piece)` for each piece. The part is
    /// that of [`Walls::holder`].
    pub fn pieces<const N: usize>(
        &self,
        simplex: [Barycentric; N],
        mut visit: impl FnMut(Option<u8>, &[Barycentric; N]),
    ) {
        self.divided(simplex, |middle, piece| visit(self.holder(middle), piece));
    }

    /// Divides a simplex along the walls and calls `visit(middle, piece)` for each piece.
    fn divided<const N: usize>(
        &self,
        simplex: [Barycentric; N],
        mut visit: impl FnMut(&Barycentric, &[Barycentric; N]),
    ) {
        let mut stack = vec![(simplex, 0)];
        while let Some((piece, blade)) = stack.pop() {
            match self.distances.get(blade) {
                Some(distances) => divide(piece, distances, &mut |part| stack.push((part, blade + 1))),
                None => {
                    let middle = std::array::from_fn(|axis| {
                        piece.iter().map(|corner| corner[axis]).sum::<f64>() / N as f64
                    });
                    visit(&middle, &piece);
                }
            }
        }
    }

    fn sides(&self, distance: impl Fn(&[f32; 4]) -> f64) -> Sides {
        let bits = self.distances.iter().enumerate();
        bits.fold(0, |sides, (blade, distances)| sides | u8::from(distance(distances) >= 0.0) << blade)
    }

    /// The blades that have each part on one side only.
    fn dividing(&self, corners: &[Sides; 4]) -> Sides {
        let mixed = (0..count(&self.parts)).fold(0, |mixed, part| {
            let of_part = (0..4).filter(|&n| self.parts[n] == part).map(|n| corners[n]);
            let (all, any) = of_part.fold((u8::MAX, 0), |(all, any), sides| (all & sides, any | sides));
            mixed | all ^ any
        });
        !mixed
    }
}

/// Raises the shares of some parts to a least share, at the cost of the largest one. Their sum
/// stays the same.
pub(super) fn raise(shares: &mut [f64; 4], parts: u8, least: f64) {
    let largest = (0..4).fold(0, |best, n| if shares[n] > shares[best] { n } else { best });
    for part in (0..4).filter(|&n| n != largest && parts >> n & 1 == 1) {
        let missing = (least - shares[part]).max(0.0);
        shares[part] += missing;
        shares[largest] -= missing;
    }
}

fn weighted(distances: &[f32; 4], point: &Barycentric) -> f64 {
    distances.iter().zip(point).map(|(d, part)| f64::from(*d) * part).sum()
}

/// Divides a simplex where the interpolated distance is zero. It halves an edge whose ends are on
/// different sides at its zero, until there is none.
///
/// The order of edges and of their ends depends on the coordinates only. So pieces of a tet that
/// share a face divide it in the same way and with the same bits.
fn divide<const N: usize>(
    piece: [Barycentric; N],
    distances: &[f32; 4],
    done: &mut dyn FnMut([Barycentric; N]),
) {
    let values = piece.each_ref().map(|corner| weighted(distances, corner));
    divide_at(piece, values, done);
}

fn divide_at<const N: usize>(
    piece: [Barycentric; N],
    values: [f64; N],
    done: &mut dyn FnMut([Barycentric; N]),
) {
    // Corners of a tet come before points on its edges, in the order of their numbers.
    let mut order: [usize; N] = std::array::from_fn(|n| n);
    order.sort_by(|&a, &b| piece[b].partial_cmp(&piece[a]).unwrap_or(Ordering::Equal));
    let pairs = (0..N).flat_map(|a| (a + 1..N).map(move |b| (a, b)));
    let crossing = pairs.map(|(a, b)| (order[a], order[b])).find(|&(a, b)| values[a] * values[b] < 0.0);
    let Some((a, b)) = crossing else { return done(piece) };
    let part = values[a] / (values[a] - values[b]);
    let zero = std::array::from_fn(|axis| (1.0 - part) * piece[a][axis] + part * piece[b][axis]);
    for replaced in [a, b] {
        let (mut half, mut of_half) = (piece, values);
        half[replaced] = zero;
        of_half[replaced] = 0.0;
        divide_at(half, of_half, done);
    }
}

fn determinant(rows: &[Barycentric; 4]) -> f64 {
    nalgebra::Matrix4::from_fn(|r, c| rows[r][c]).determinant()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sever::components::parts_of;
    use cutis_test_kit::Random;

    fn walls<'a>(distances: &'a [[f32; 4]], severed: u8) -> Walls<'a> {
        Walls { distances, parts: parts_of(severed), kept: 15, piece: None }
    }

    #[test]
    fn a_corner_that_is_cut_off_has_the_product_of_its_parts() {
        let walls = walls(&[[-1.0, -1.0, -3.0, 1.0]], 0b11_0100);
        let volumes = walls.volumes();
        assert!((volumes[1] - 0.5 * 0.5 * 0.25).abs() < 1e-12, "{volumes:?}");
        assert!((volumes.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        let areas = walls.areas(0);
        assert!((areas[1] - 0.5 * 0.25).abs() < 1e-12, "{areas:?}");
        assert_eq!(walls.areas(3), [1.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn two_corners_on_each_side_share_as_sampling_says() {
        let walls = walls(&[[2.0, 1.0, -1.0, -0.5]], 0b01_1110);
        let volumes = walls.volumes();
        let (mut inside, mut all) = (0.0, 0.0);
        const STEPS: i32 = 60;
        for a in 0..STEPS {
            for b in 0..STEPS - a {
                for c in 0..STEPS - a - b {
                    let [a, b, c] = [a, b, c].map(|n| (f64::from(n) + 0.25) / f64::from(STEPS));
                    inside += f64::from(u8::from(walls.owner(&[a, b, c, 1.0 - a - b - c]) == 0));
                    all += 1.0;
                }
            }
        }
        assert!((volumes[0] - inside / all).abs() < 5e-3, "{volumes:?}, {}", inside / all);
    }

    /// Each face of a piece is that of another piece, with the same bits, or in a face of the tet.
    #[test]
    fn pieces_of_several_walls_fit_each_other() {
        use std::collections::HashMap;
        let mut random = Random::new(4);
        let (mut inner, mut most) = (0, 0);
        for _ in 0..300 {
            let distances: [[f32; 4]; 3] =
                std::array::from_fn(|_| std::array::from_fn(|_| random.below(2000) as f32 - 999.5));
            let mut faces: HashMap<[[u64; 4]; 3], usize> = HashMap::new();
            let mut pieces = 0;
            let unit = |n: usize| std::array::from_fn(|axis| f64::from(u8::from(axis == n)));
            walls(&distances, 0b11_1111).pieces([unit(0), unit(1), unit(2), unit(3)], |_, piece| {
                pieces += 1;
                for opposite in 0..4 {
                    let face = [1, 2, 3].map(|step| piece[(opposite + step) % 4]);
                    if !(0..4).any(|axis| face.iter().all(|corner| corner[axis] == 0.0)) {
                        let mut key = face.map(|corner| corner.map(f64::to_bits));
                        key.sort_unstable();
                        *faces.entry(key).or_default() += 1;
                    }
                }
            });
            assert!(faces.values().all(|&count| count == 2), "{distances:?}: {pieces} pieces");
            (inner, most) = (inner + faces.len(), most.max(pieces));
        }
        assert!(inner > 10_000 && most > 30, "the control: {inner} faces, up to {most} pieces");
    }

    #[test]
    fn raised_shares_have_the_same_sum() {
        let mut shares = [0.0625, 0.875, 0.0625, 0.0];
        raise(&mut shares, 0b0011, 0.125);
        assert_eq!(shares, [0.125, 0.8125, 0.0625, 0.0]);
    }

    /// Two blades cross in the tet. The second one ends at the first, so that corners 2 and 3 stay
    /// together.
    #[test]
    fn a_blade_that_ends_in_the_tet_divides_only_its_side() {
        let walls = walls(&[[1.0, 1.0, -1.0, -1.0], [1.0, -1.0, 1.0, -1.0]], 0b01_1111);
        assert_eq!(walls.parts, [0, 1, 2, 2]);
        assert_eq!(walls.owner(&[0.5, 0.1, 0.3, 0.1]), 0);
        assert_eq!(walls.owner(&[0.1, 0.5, 0.1, 0.3]), 1);
        assert_eq!(walls.owner(&[0.1, 0.3, 0.1, 0.5]), 2);
        assert_eq!(walls.owner(&[0.3, 0.1, 0.5, 0.1]), 2);
        assert!((walls.volumes().iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!((walls.volumes()[2] - 0.5).abs() < 1e-12);
    }

    #[test]
    fn a_part_without_a_copy_leaves_its_volume_to_the_others() {
        let distances = [[-1.0, -1.0, -1.0, 1e-9]];
        let walls = Walls { kept: 0b01, ..walls(&distances, 0b11_0100) };
        assert_eq!(walls.owner(&[0.0, 0.0, 0.0, 1.0]), 0);
        assert_eq!(walls.volumes(), [1.0, 0.0, 0.0, 0.0]);
    }
}
