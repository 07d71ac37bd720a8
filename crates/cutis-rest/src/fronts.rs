//! Several products with a matrix in one pass through it.
//!
//! The memory is too slow to read a large matrix for every product. So the products that follow on
//! each other move through the rows together: while the first one is at some rows, the next one is
//! a little behind, at rows whose neighbors the first one has left, and finds them in the cache
//! (wavefront blocking: Wellein and others, Proc. COMPSAC 2009). Every row has the same sums as
//! with products one after the other.
//!
//! Threads do not wait for each other on the way. Each one takes a domain of rows and makes all
//! products there, as far as they need no rows of other domains. Then the rows around the borders
//! of the domains follow (as in the tilings of Frigo and Strumpen, Proc. ICS 2005).

use std::ops::Range;

use rayon::prelude::*;

use crate::symmetric::Neighbors;

/// Rows of a piece. All rows of a piece go through a product together.
const PIECE: usize = 256;
/// The most domains for each thread.
const DOMAINS: usize = 4;
/// Longest time of a thread over that without waiting.
const WAITING: f64 = 1.1;

/// The order in which `N` stages take the rows of a matrix. A stage needs what the stage before has
/// made at its row and at the neighbors of the row.
pub(crate) struct Fronts<const N: usize> {
    /// The domains, and then the rows around their borders.
    passes: [Vec<Domain>; 2],
}

/// Rows that one thread takes.
pub(crate) struct Domain {
    /// All rows that it reads or writes.
    pub rows: Range<usize>,
    /// The stages with the rows that they take, in their order.
    pub steps: Vec<(usize, Range<usize>)>,
}

/// For each piece the first row among it and its neighbors, and the end of these.
struct Reach {
    height: usize,
    low: Vec<usize>,
    high: Vec<usize>,
}

impl Reach {
    fn of(neighbors: &Neighbors) -> Self {
        let height = neighbors.count();
        let of_piece = |piece: usize| {
            let rows = piece * PIECE..((piece + 1) * PIECE).min(height);
            let of_rows = || rows.clone().map(|row| neighbors.of(row));
            let low = of_rows().filter_map(<[u32]>::first).min().map_or(rows.start, |&low| low as usize);
            let high = of_rows().filter_map(<[u32]>::last).max().map_or(0, |&last| last as usize + 1);
            (low.min(rows.start), high.max(rows.end))
        };
        let (low, high) = (0..height.div_ceil(PIECE)).into_par_iter().map(of_piece).unzip();
        Self { height, low, high }
    }

    /// The first row of a piece.
    fn start(&self, piece: usize) -> usize {
        (piece * PIECE).min(self.height)
    }

    /// The longest run of pieces at the end of a range that read no rows before `within`, up to the
    /// first one that reads rows after it. Both ranges count pieces.
    fn inside(&self, pieces: &Range<usize>, within: &Range<usize>) -> Range<usize> {
        let (low, high) = (self.start(within.start), self.start(within.end));
        let start = pieces.clone().rev().find(|&piece| self.low[piece] < low).map_or(pieces.start, |n| n + 1);
        let end = (start..pieces.end).find(|&piece| self.high[piece] > high).unwrap_or(pieces.end);
        start..end
    }

    /// The steps of stages over their pieces. A stage follows the one before as closely as it can.
    /// What it reads beyond the pieces of that one must be there.
    fn steps<const N: usize>(&self, stages: &[Range<usize>; N]) -> Vec<(usize, Range<usize>)> {
        let mut next: [usize; N] = std::array::from_fn(|stage| stages[stage].start);
        let mut steps = Vec::new();
        while next != std::array::from_fn(|stage| stages[stage].end) {
            for stage in 0..N {
                // The rows that the stage before has left. After its last piece all are.
                let left = match stage.checked_sub(1) {
                    Some(before) if next[before] < stages[before].end => self.start(next[before]),
                    _ => self.height,
                };
                let most = if stage == 0 { 1 } else { stages[stage].len() };
                for _ in 0..most {
                    let piece = next[stage];
                    if piece == stages[stage].end || self.high[piece] > left {
                        break;
                    }
                    steps.push((stage, self.start(piece)..self.start(piece + 1)));
                    next[stage] += 1;
                }
            }
        }
        steps
    }

    /// The fronts with some domains. None if the rows around different borders need each other.
    fn fronts<const N: usize>(&self, count: usize) -> Option<Fronts<N>> {
        let border = |n: usize| n * self.low.len() / count;
        let domains: Vec<Range<usize>> = (0..count).map(|n| border(n)..border(n + 1)).collect();
        let stages_of = |domain: &Range<usize>| -> [Range<usize>; N] {
            let mut before = domain.clone();
            std::array::from_fn(|_| {
                before = self.inside(&before, &before);
                before.clone()
            })
        };
        let stages: Vec<[Range<usize>; N]> = domains.iter().map(stages_of).collect();
        let domain = |pieces: &Range<usize>, stages: &[Range<usize>; N]| Domain {
            rows: self.start(pieces.start)..self.start(pieces.end),
            steps: self.steps(stages),
        };
        let first = domains.iter().zip(&stages).map(|(pieces, stages)| domain(pieces, stages)).collect();
        let mut second = Vec::new();
        for (n, pair) in stages.windows(2).enumerate() {
            let middle = |domain: &Range<usize>| domain.start + domain.len() / 2;
            let pieces = middle(&domains[n])..middle(&domains[n + 1]);
            let around: [Range<usize>; N] =
                std::array::from_fn(|stage| pair[0][stage].end..pair[1][stage].start);
            // Each stage reads rows that the stage before has taken in these domains, or here.
            for stage in 0..N {
                let (low, high) = match stage.checked_sub(1) {
                    Some(before) => (pair[0][before].start, pair[1][before].end),
                    None => (pieces.start, pieces.end),
                };
                let within = low.max(pieces.start)..high.min(pieces.end);
                let own = &around[stage];
                if own.start > own.end || self.inside(own, &within) != *own || pair[0][stage].is_empty() {
                    return None;
                }
            }
            second.push(domain(&pieces, &around));
        }
        Some(Fronts { passes: [first, second] })
    }
}

impl<const N: usize> Fronts<N> {
    /// The fronts for nodes with these neighbors that the threads leave soonest. None if they would
    /// wait too long for each other.
    pub fn of(neighbors: &Neighbors) -> Option<Self> {
        let threads = rayon::current_num_threads();
        let reach = Reach::of(neighbors);
        let most = WAITING * (N * neighbors.count()) as f64 / threads as f64;
        let all = (1..=DOMAINS).filter_map(|each| reach.fronts(each * threads));
        let timed = all.map(|fronts: Self| (fronts.longest(threads), fronts));
        let soonest = timed.min_by_key(|(longest, _)| *longest);
        soonest.filter(|(longest, _)| *longest as f64 <= most).map(|(_, fronts)| fronts)
    }

    /// Rows that a thread takes at most in all stages, if threads take the domains of a pass by
    /// turns.
    fn longest(&self, threads: usize) -> usize {
        let of_thread = |pass: &[Domain], thread: usize| -> usize {
            pass.iter()
                .skip(thread)
                .step_by(threads)
                .flat_map(|domain| &domain.steps)
                .map(|(_, rows)| rows.len())
                .sum()
        };
        let of_pass = |pass: &Vec<Domain>| (0..threads).map(|thread| of_thread(pass, thread)).max();
        self.passes.iter().filter_map(of_pass).sum()
    }

    /// The domains, whose rows do not overlap, and then those around their borders.
    pub fn passes(&self) -> &[Vec<Domain>; 2] {
        &self.passes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The neighbors in a band of a width, and a row far away that the first one needs.
    fn neighbors(height: usize, width: usize, far: Option<usize>) -> Neighbors {
        let (mut starts, mut later) = (vec![0], Vec::new());
        for row in 0..height {
            later.extend((row + 1..(row + width + 1).min(height)).map(|neighbor| neighbor as u32));
            later.extend(far.filter(|_| row == 0).map(|far| far as u32));
            starts.push(later.len());
        }
        Neighbors::from_later(starts, &later)
    }

    /// Each stage takes each row once, after the stage before at the row and its neighbors, and
    /// before the stage three later. Domains of a pass neither read nor write rows of others.
    #[test]
    fn a_stage_takes_rows_whose_neighbors_are_done() {
        let bodies = [(0, 0, None), (1, 0, None), (40_000, 300, None), (40_000, 300, Some(39_000))];
        for (height, width, far) in bodies {
            let neighbors = neighbors(height, width, far);
            let reach = Reach::of(&neighbors);
            let most = (1..30).rev().find_map(|count| reach.fronts::<4>(count)).unwrap();
            let domains = most.passes()[0].len();
            let expected = if far.is_none() && height > 1 { 5..10 } else { 1..2 };
            assert!(expected.contains(&domains), "{domains} domains of {height} rows, {far:?}");
            let mut done = vec![0; height];
            for pass in most.passes() {
                assert!(pass.windows(2).all(|pair| pair[0].rows.end <= pair[1].rows.start));
                for domain in pass {
                    for (stage, rows) in &domain.steps {
                        for row in rows.clone() {
                            assert_eq!(done[row], *stage, "row {row}");
                            done[row] += 1;
                            for &neighbor in neighbors.of(row) {
                                let neighbor = neighbor as usize;
                                assert!(domain.rows.contains(&neighbor), "row {row} reads {neighbor}");
                                let ready = *stage..stage + 3;
                                assert!(ready.contains(&done[neighbor]), "stage {stage}, row {row}");
                            }
                        }
                    }
                }
            }
            assert!(done.iter().all(|&stages| stages == 4));
        }
    }

    /// With a narrow band, later stages follow closely. A row far away delays them.
    #[test]
    fn the_stages_are_near_each_other() {
        let apart = |far: Option<usize>| {
            let fronts = Reach::of(&neighbors(100_000, 300, far)).fronts::<4>(1).unwrap();
            let mut ends = [0; 4];
            let mut most = 0;
            for (stage, rows) in &fronts.passes()[0][0].steps {
                ends[*stage] = rows.end;
                most = most.max(ends[0] - ends[3]);
            }
            most
        };
        assert!(apart(None) < 3_000, "{}", apart(None));
        assert!(apart(Some(60_000)) > 50_000, "{}", apart(Some(60_000)));
    }
}
