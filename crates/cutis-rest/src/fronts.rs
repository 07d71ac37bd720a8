//! Several products with a matrix in one pass through it.
//!
//! The memory is too slow to read a large matrix for every product. So the products that follow on
//! each other move through the rows together: while the first one is at some rows, the next one is
//! a little behind, at rows whose neighbors the first one has left, and finds them in the cache
//! (wavefront blocking: Wellein and others, Proc. COMPSAC 2009). A layer of a large body does not
//! fit the cache. So the products go through one strip of the body after the other. In each strip
//! the later ones stay a little behind at its side, too, and take what is left there in the next
//! strip. Every row has the same sums as with products one after the other.
//!
//! Threads do not wait for each other on the way. Each one takes a domain of rows and makes all
//! products there, as far as they need no rows of other domains. What is left around the borders of
//! the domains follows, one product after the other.

use std::collections::VecDeque;
use std::ops::Range;

use nalgebra::Point3;
use rayon::prelude::*;

use crate::symmetric::Neighbors;

/// Bytes of the matrix in a piece. All rows of a piece go through a product together.
const PIECE: usize = 1 << 16;
/// The fewest rows of a piece.
const FEWEST: usize = 16;
/// Bytes of the matrix in one layer of a strip.
const STRIP: usize = 1 << 20;
/// Bytes of a matrix that the cache holds. Its products need no order.
const SMALL: usize = 1 << 20;

/// The order in which `N` stages take the rows of a matrix. A stage needs what the stage before has
/// made at its row and at the neighbors of the row.
pub(crate) struct Fronts<const N: usize> {
    /// Domains that need nothing from each other.
    domains: Vec<Domain>,
    /// The rows that are left for each stage then, ascending, in parts for threads.
    rest: [Vec<Range<usize>>; N],
}

/// Rows that one thread takes.
pub(crate) struct Domain {
    /// All rows that it reads or writes.
    pub rows: Range<usize>,
    /// The stages with the rows that they take, in their order.
    pub steps: Vec<(usize, Range<usize>)>,
}

/// Pieces of the rows of a matrix.
struct Pieces {
    /// All rows, and the rows of each piece but the last one.
    height: usize,
    size: usize,
    /// For each piece itself and its neighbors, ascending.
    neighbors: Vec<Vec<u32>>,
    /// The strip of each piece.
    strips: Vec<u32>,
}

impl Pieces {
    /// Pieces of rows with these neighbors and places. A row has so many bytes on average.
    fn of(neighbors: &Neighbors, places: &[Point3<f64>], row_bytes: usize) -> Self {
        let height = neighbors.count();
        let size = (PIECE / row_bytes.max(1)).max(FEWEST);
        let rows = |piece: usize| piece * size..((piece + 1) * size).min(height);
        let around = |piece: usize| {
            let mut pieces = vec![piece as u32];
            for &row in rows(piece).flat_map(|row| neighbors.of(row)) {
                let other = row / size as u32;
                if !pieces.contains(&other) {
                    pieces.push(other);
                }
            }
            pieces.sort_unstable();
            pieces
        };
        let count = height.div_ceil(size);
        let center = |piece: usize| -> [f64; 3] {
            let rows = rows(piece);
            let scale = 1.0 / rows.len() as f64;
            places[rows]
                .iter()
                .fold([0.0; 3], |sum, place| std::array::from_fn(|n| sum[n] + scale * place[n]))
        };
        let (neighbors, centers): (Vec<_>, Vec<_>) =
            (0..count).into_par_iter().map(|piece| (around(piece), center(piece))).unzip();
        Self { height, size, neighbors, strips: strips(&centers, height * row_bytes) }
    }

    fn count(&self) -> usize {
        self.neighbors.len()
    }

    /// The rows of some pieces.
    fn rows(&self, pieces: Range<usize>) -> Range<usize> {
        (pieces.start * self.size).min(self.height)..(pieces.end * self.size).min(self.height)
    }

    /// Takes some pieces through all stages, as far as they need no other ones. `done` counts the
    /// stages that each piece has behind it. Later stages follow as soon as they can.
    fn domain<const N: usize>(&self, pieces: Range<usize>, done: &mut [usize]) -> Domain {
        let is_ready = |piece: usize, done: &[usize]| {
            let near =
                |&other: &u32| pieces.contains(&(other as usize)) && done[other as usize] >= done[piece];
            done[piece] < N && self.neighbors[piece].iter().all(near)
        };
        let mut order: Vec<usize> = pieces.clone().collect();
        order.sort_by_key(|&piece| self.strips[piece]);
        let (mut steps, mut ready) = (Vec::new(), VecDeque::new());
        for first in order {
            ready.push_back(first);
            while let Some(piece) = ready.pop_front() {
                if !is_ready(piece, done) {
                    continue;
                }
                steps.push((done[piece], self.rows(piece..piece + 1)));
                done[piece] += 1;
                let near = self.neighbors[piece].iter().map(|&other| other as usize);
                ready.extend(near.filter(|&other| done[other] > 0 && is_ready(other, done)));
            }
        }
        Domain { rows: self.rows(pieces), steps }
    }

    /// The fronts with some domains.
    fn fronts<const N: usize>(&self, count: usize) -> Fronts<N> {
        let mut done = vec![0; self.count()];
        let border = |n: usize| n * self.count() / count.max(1);
        let domains = (0..count).map(|n| self.domain::<N>(border(n)..border(n + 1), &mut done)).collect();
        let rest = std::array::from_fn(|stage| {
            let left = (0..self.count()).filter(|&piece| done[piece] <= stage);
            left.map(|piece| self.rows(piece..piece + 1)).collect()
        });
        Fronts { domains, rest }
    }
}

/// Strips of pieces with these centers, along the axis on which the center changes second to least
/// from piece to piece.
fn strips(centers: &[[f64; 3]], bytes: usize) -> Vec<u32> {
    let range = |axis: usize| {
        let of_axis = || centers.iter().map(|center| center[axis]);
        (of_axis().fold(f64::INFINITY, f64::min), of_axis().fold(f64::NEG_INFINITY, f64::max))
    };
    let steps =
        |axis: usize| centers.windows(2).map(|pair| (pair[1][axis] - pair[0][axis]).abs()).sum::<f64>();
    let mut axes: Vec<(f64, usize)> = (0..3)
        .map(|axis| {
            let (low, high) = range(axis);
            (if high > low { steps(axis) / (high - low) } else { f64::INFINITY }, axis)
        })
        .collect();
    axes.sort_by(|a, b| a.0.total_cmp(&b.0));
    // The slowest axis is crossed once, and the next one twice in each layer: forth, and back to
    // the start of the next layer.
    let layers = (0.5 * axes[1].0 / axes[0].0).clamp(1.0, 1e6);
    let count = (bytes as f64 / layers / STRIP as f64).ceil();
    let ((low, high), axis) = (range(axes[1].1), axes[1].1);
    let strip = |center: &[f64; 3]| {
        let share = (center[axis] - low) / (high - low);
        if share.is_finite() { (share * count).min(count - 1.0) as u32 } else { 0 }
    };
    centers.iter().map(strip).collect()
}

impl<const N: usize> Fronts<N> {
    /// The fronts for nodes with these neighbors and places. A row has so many bytes on average.
    pub fn of(neighbors: &Neighbors, places: &[Point3<f64>], row_bytes: usize) -> Self {
        let pieces = Pieces::of(neighbors, places, row_bytes);
        let is_small = neighbors.count() * row_bytes <= SMALL;
        pieces.fronts(if is_small { 0 } else { rayon::current_num_threads() })
    }

    /// The domains, whose rows do not overlap.
    pub fn domains(&self) -> &[Domain] {
        &self.domains
    }

    /// The rows that are left for a stage after the domains, in parts that do not overlap.
    pub fn rest(&self, stage: usize) -> &[Range<usize>] {
        &self.rest[stage]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The neighbors in a band of a width, and a row far away that the first one needs.
    fn band(height: usize, width: usize, far: Option<usize>) -> Neighbors {
        let (mut starts, mut later) = (vec![0], Vec::new());
        for row in 0..height {
            later.extend((row + 1..(row + width + 1).min(height)).map(|neighbor| neighbor as u32));
            later.extend(far.filter(|_| row == 0).map(|far| far as u32));
            starts.push(later.len());
        }
        Neighbors::from_later(starts, &later)
    }

    /// The points of a lattice, whose neighbors share a tetrahedron, and their places.
    fn lattice([width, depth, height]: [usize; 3]) -> (Neighbors, Vec<Point3<f64>>) {
        let number = |[x, y, z]: [usize; 3]| (z * depth + y) * width + x;
        let (mut starts, mut later, mut places) = (vec![0], Vec::new(), Vec::new());
        for n in 0..width * depth * height {
            let [x, y, z] = [n % width, n / width % depth, n / width / depth];
            places.push(Point3::from([x, y, z].map(|x| x as f64)));
            for step in 1..8 {
                let [x, y, z] = [x + step % 2, y + step / 2 % 2, z + step / 4];
                if x < width && y < depth && z < height {
                    later.push(number([x, y, z]) as u32);
                }
            }
            starts.push(later.len());
        }
        (Neighbors::from_later(starts, &later), places)
    }

    /// Each stage takes each row once, after the stage before at the row and its neighbors, and
    /// before the stage three later. Domains neither read nor write rows of others.
    #[test]
    fn a_stage_takes_rows_whose_neighbors_are_done() {
        let on_line = |neighbors: Neighbors| {
            let places = (0..neighbors.count()).map(|n| Point3::new(n as f64, 0.0, 0.0)).collect();
            (neighbors, places)
        };
        let bodies = [
            on_line(band(0, 0, None)),
            on_line(band(1, 0, None)),
            on_line(band(40_000, 300, None)),
            on_line(band(40_000, 300, Some(39_000))),
            lattice([16, 64, 40]),
        ];
        for (body, (neighbors, places)) in bodies.iter().enumerate() {
            let pieces = Pieces::of(neighbors, places, 2048);
            let strips: std::collections::BTreeSet<u32> = pieces.strips.iter().copied().collect();
            assert_eq!(strips.len() > 1, body == 4, "{} strips of body {body}", strips.len());
            for count in [0, 1, 3, 7] {
                let fronts = pieces.fronts::<4>(count);
                let mut done = vec![0; neighbors.count()];
                let mut take = |stage: usize, rows: &Range<usize>, within: &Range<usize>| {
                    for row in rows.clone() {
                        assert_eq!(done[row], stage, "row {row}");
                        done[row] += 1;
                        for &neighbor in neighbors.of(row) {
                            let neighbor = neighbor as usize;
                            assert!(within.contains(&neighbor), "row {row} reads {neighbor}");
                            let ready = stage..stage + 3;
                            assert!(ready.contains(&done[neighbor]), "stage {stage}, row {row}");
                        }
                    }
                };
                let domains = fronts.domains();
                assert_eq!(domains.len(), count);
                assert!(domains.windows(2).all(|pair| pair[0].rows.end <= pair[1].rows.start));
                for domain in domains {
                    domain.steps.iter().for_each(|(stage, rows)| take(*stage, rows, &domain.rows));
                }
                let mut left = 0;
                for stage in 0..4 {
                    let rest = fronts.rest(stage);
                    assert!(rest.windows(2).all(|pair| pair[0].end <= pair[1].start));
                    rest.iter().for_each(|rows| take(stage, rows, &(0..neighbors.count())));
                    left += rest.iter().map(Range::len).sum::<usize>();
                }
                assert!(done.iter().all(|&stages| stages == 4));
                match count {
                    0 => assert_eq!(left, 4 * neighbors.count()),
                    1 => assert_eq!(left, 0),
                    _ => assert!(left <= 3 * neighbors.count(), "{left} rows are left"),
                }
            }
        }
    }

    /// How many rows are taken between the first and the last stage of a row, at most for three of
    /// four rows.
    fn apart(neighbors: &Neighbors, places: &[Point3<f64>]) -> usize {
        let fronts = Pieces::of(neighbors, places, 2048).fronts::<4>(1);
        let (mut time, mut found) = (0, Vec::new());
        let mut first = vec![0; neighbors.count()];
        for (stage, rows) in &fronts.domains()[0].steps {
            match stage {
                0 => rows.clone().for_each(|row| first[row] = time),
                3 => found.extend(rows.clone().map(|row| time - first[row])),
                _ => {}
            }
            time += rows.len();
        }
        found.sort_unstable();
        found[3 * found.len() / 4]
    }

    /// Later stages follow closely, and more so in strips. A row far away delays only rows near it.
    #[test]
    fn the_stages_are_near_each_other() {
        let (neighbors, places) = lattice([16, 128, 32]);
        let without = apart(&neighbors, &vec![Point3::origin(); places.len()]);
        let with = apart(&neighbors, &places);
        let layer = 16 * 128;
        assert!((10 * layer..16 * layer).contains(&without), "{without} rows without strips");
        assert!(with < without / 3, "{with} and {without} rows");
        let band_apart = |far: Option<usize>| apart(&band(50_000, 300, far), &vec![Point3::origin(); 50_000]);
        assert!(band_apart(None) < 5_000, "{}", band_apart(None));
        assert!(band_apart(Some(49_000)) < 5_000, "{}", band_apart(Some(49_000)));
    }
}
