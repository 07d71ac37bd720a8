//! Runs: constraints in a row whose vertices advance by two.
//!
//! A color has every second constraint of a row of vertices, because neighbors share a vertex. So
//! the vertices of one constraint are those of the constraint before plus two, and in
//! [`Columns`](crate::Columns) they are adjacent. Edges that are not along a row may start at every
//! vertex: then those at even vertices are one row and those at odd vertices another one. Any mesh
//! whose indices follow rows of vertices has runs. The constraints of a color may be in any order,
//! so that [`arrange`] cuts the rows into pieces of one length and puts these behind each other.

use std::ops::Range;

/// Number of constraints of a long piece. It fills SIMD lanes of every width.
pub(crate) const ROW: usize = super::MAX_LANES;

/// Number of constraints of a short piece, for what is left of a row.
pub(crate) const QUAD: usize = 4;

/// Largest number of runs of a color in one tile: long pieces, short ones, and the rest.
pub(crate) const RUNS: usize = 3;

/// Constraints from `start` up to the start of the next run, in pieces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Run {
    start: u32,
    /// [`ROW`], [`QUAD`], or 1 for constraints in no row.
    piece: u32,
    /// Number of long pieces in all runs before this one.
    rows_before: u32,
}

/// The runs of a kind, in ascending order.
#[derive(Clone, Debug, Default)]
pub(super) struct Runs {
    list: Vec<Run>,
    /// Number of long pieces.
    rows: u32,
}

impl Runs {
    /// Returns the length of the pieces of the first constraints in `range`, and which constraints
    /// are in such pieces. The pieces count from the start of these constraints. A range that
    /// starts within a piece has pieces of length 1 up to the next one.
    #[inline]
    pub(super) fn part(&self, range: Range<usize>) -> (usize, Range<usize>) {
        let next = self.list.partition_point(|run| run.start as usize <= range.start);
        let end = self.list.get(next).map_or(range.end, |run| range.end.min(run.start as usize));
        let Some(run) = next.checked_sub(1).map(|last| self.list[last]) else { return (1, range.start..end) };
        let piece = run.piece as usize;
        match (range.start - run.start as usize) % piece {
            0 => (piece, range.start..end),
            place => (1, range.start..end.min(range.start + piece - place)),
        }
    }

    /// Divides constraints at the ends of runs. A color in one tile has at most [`RUNS`] runs. If
    /// there are more, the constraints stay together in the first of the ranges.
    pub(super) fn divide(&self, range: Range<usize>) -> [Range<usize>; RUNS] {
        let mut start = range.start;
        let parts = std::array::from_fn(|_| {
            let end = self.part(start..range.end).1.end;
            let part = start..end;
            start = end;
            part
        });
        if start == range.end { parts } else { [range.clone(), range.end..range.end, range.end..range.end] }
    }

    /// Returns the number of long pieces before the constraint at `place`, which is in a long
    /// piece.
    #[inline]
    pub(super) fn rows_before(&self, place: usize) -> usize {
        let last = self.list.partition_point(|run| run.start as usize <= place) - 1;
        self.list[last].rows_before as usize + (place - self.list[last].start as usize) / ROW
    }

    /// Returns the places of the first constraints of all long pieces of `count` constraints.
    pub(super) fn rows(&self, count: usize) -> impl Iterator<Item = usize> {
        let ends = self.list.iter().skip(1).map(|run| run.start as usize).chain([count]);
        let long = self.list.iter().zip(ends).filter(|(run, _)| run.piece as usize == ROW);
        long.flat_map(|(run, end)| (run.start as usize..end).step_by(ROW))
    }

    /// Returns how many of `count` constraints are in pieces of rows.
    pub(super) fn constraints_in_rows(&self, count: usize) -> usize {
        let ends = self.list.iter().skip(1).map(|run| run.start as usize).chain([count]);
        let lengths = self.list.iter().zip(ends).map(|(run, end)| (run.piece, end - run.start as usize));
        lengths.filter(|&(piece, _)| piece > 1).map(|(_, length)| length).sum()
    }

    /// Returns the memory in bytes.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.list.as_slice())
    }
}

/// Lists of constraints by the length of their pieces, kept between calls of [`arrange`].
#[derive(Default)]
pub(super) struct Scratch {
    /// Constraints whose first vertex is even, and those whose first vertex is odd.
    halves: [Vec<u32>; 2],
    /// Pieces of the rows in each half.
    rows: [Vec<u32>; 2],
    quads: [Vec<u32>; 2],
    others: Vec<u32>,
}

/// Sorts `constraints`, which will be at place `start` of the kind, into runs: first the long
/// pieces of rows, then the short ones, then all other constraints. Each run is in ascending order
/// of its first constraints, so that adjacent constraints stay close to each other.
pub(super) fn arrange<const N: usize>(
    constraints: &mut [u32],
    start: usize,
    indices: &[[u32; N]],
    runs: &mut Runs,
    scratch: &mut Scratch,
) {
    let Scratch { halves, rows, quads, others } = scratch;
    halves.iter_mut().chain(&mut *rows).chain(&mut *quads).chain([&mut *others]).for_each(Vec::clear);
    for &k in &*constraints {
        halves[(indices[k as usize][0] & 1) as usize].push(k);
    }
    let follows = |a: &u32, b: &u32| {
        let (a, b) = (&indices[*a as usize], &indices[*b as usize]);
        a.iter().zip(b).all(|(a, b)| a.checked_add(2) == Some(*b))
    };
    for ((half, rows), quads) in halves.iter().zip(&mut *rows).zip(&mut *quads) {
        for row in half.chunk_by(follows) {
            let (long, rest) = row.split_at(row.len() / ROW * ROW);
            let (short, rest) = rest.split_at(rest.len() / QUAD * QUAD);
            rows.extend_from_slice(long);
            quads.extend_from_slice(short);
            others.extend_from_slice(rest);
        }
    }
    let mut filled = 0;
    let mut append = |list: &[u32], piece: usize| {
        if !list.is_empty() {
            let rows_before = runs.rows;
            runs.list.push(Run { start: (start + filled) as u32, piece: piece as u32, rows_before });
            runs.rows += if piece == ROW { (list.len() / ROW) as u32 } else { 0 };
            constraints[filled..filled + list.len()].copy_from_slice(list);
            filled += list.len();
        }
    };
    append(&merged(rows, ROW), ROW);
    let quads = merged(quads, QUAD);
    // Only whole groups of lanes are read in pieces.
    let (whole, rest) = quads.split_at(quads.len() / ROW * ROW);
    append(whole, QUAD);
    others.extend_from_slice(rest);
    others.sort_unstable();
    append(others, 1);
}

/// The pieces of two ascending lists, in ascending order of their first constraints.
fn merged(lists: &[Vec<u32>; 2], piece: usize) -> Vec<u32> {
    let mut heads = lists.each_ref().map(|list| list.chunks_exact(piece).peekable());
    let mut all = Vec::with_capacity(lists[0].len() + lists[1].len());
    loop {
        let [even, odd] = heads.each_mut().map(|head| head.peek().map(|piece| piece[0]));
        let next = match (even, odd) {
            (Some(even), Some(odd)) => usize::from(odd < even),
            (Some(_), None) => 0,
            (None, Some(_)) => 1,
            (None, None) => return all,
        };
        all.extend_from_slice(heads[next].next().unwrap_or_default());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The order of the constraints `0..count`, and how many are in long pieces, in short ones and
    /// in none.
    fn arranged<const N: usize>(indices: &[[u32; N]]) -> (Vec<u32>, [usize; 3]) {
        let mut order: Vec<u32> = (0..indices.len() as u32).collect();
        let mut runs = Runs::default();
        arrange(&mut order, 0, indices, &mut runs, &mut Scratch::default());
        let (mut counts, mut first) = ([0; 3], 0);
        while first < indices.len() {
            let (piece, part) = runs.part(first..indices.len());
            counts[[ROW, QUAD, 1].iter().position(|&length| length == piece).unwrap()] += part.len();
            for piece in order[part.clone()].chunks(piece) {
                let tuples = piece.iter().map(|&k| indices[k as usize]);
                let start = indices[piece[0] as usize];
                let expected = (0..).map(|n| start.map(|vertex| vertex + 2 * n));
                assert!(tuples.eq(expected.take(piece.len())), "{piece:?}");
            }
            first = part.end;
        }
        assert_eq!(runs.constraints_in_rows(indices.len()), counts[0] + counts[1]);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..indices.len() as u32), "each constraint has one place");
        (order, counts)
    }

    /// Constraints whose corners are in rows `0`, `1000` and so on, at the places of the list.
    fn rows<const N: usize>(places: impl IntoIterator<Item = u32>) -> Vec<[u32; N]> {
        places.into_iter().map(|place| std::array::from_fn(|corner| 1000 * corner as u32 + place)).collect()
    }

    #[test]
    fn every_second_vertex_starts_a_row() {
        let (order, counts) = arranged(&rows::<4>((0..40).map(|k| 2 * k)));
        assert_eq!(counts, [32, 0, 8], "two long pieces, and too few short ones");
        assert!(order.into_iter().eq(0..40));
        let (order, counts) = arranged(&rows::<2>((0..80).map(|k| k + 3)));
        assert_eq!(counts, [64, 16, 0], "even and odd vertices make a row each");
        let starts = [0, 15, 16, 31, 32].map(|place| order[place]);
        assert_eq!(starts, [0, 30, 1, 31, 32], "the pieces of both rows take turns");
    }

    #[test]
    fn other_constraints_are_in_no_row() {
        let alone = |indices: &[[u32; 2]]| arranged(indices).1 == [0, 0, indices.len()];
        assert!(!alone(&rows((0..40).map(|k| 2 * k))), "the check can fail");
        assert!(alone(&rows((0..40).map(|k| 3 * k))), "another stride");
        assert!(alone(&rows((0..40).rev())), "a stride below zero");
        assert!(alone(&rows((0..40).map(|k| k * k))), "no stride");
        assert!(alone(&(0..40).map(|k| [2 * k, 1000 + 3 * k]).collect::<Vec<_>>()), "two strides");
        assert!(alone(&rows((0..12).map(|k| 2 * k))), "too few constraints");
        assert!(alone(&[]));
    }

    #[test]
    fn rows_of_any_length_make_pieces_and_a_remainder() {
        // Rows of 11 constraints with gaps have two short pieces and three other constraints each.
        let broken = rows::<2>((0..110).map(|k| 40 * (k / 11) + 2 * (k % 11)));
        let (order, counts) = arranged(&broken);
        assert_eq!(counts, [0, 80, 30], "five groups of 16");
        assert!(order[80..].is_sorted(), "the remainder is in ascending order");
    }

    #[test]
    fn only_a_range_in_step_with_its_pieces_has_pieces() {
        let indices = rows::<2>((0..32).map(|k| 2 * k));
        let mut order: Vec<u32> = (0..32).collect();
        let mut runs = Runs::default();
        arrange(&mut order, 100, &indices, &mut runs, &mut Scratch::default());
        assert_eq!(runs.part(100..132), (ROW, 100..132));
        assert_eq!(runs.part(116..120), (ROW, 116..120));
        assert_eq!(runs.part(104..132), (1, 104..116));
        assert_eq!(runs.part(118..119), (1, 118..119));
        assert_eq!(runs.part(3..120), (1, 3..100), "before the first run");
    }

    #[test]
    fn a_color_is_divided_at_the_ends_of_its_runs() {
        // Rows of 22 constraints: long pieces of 16, short ones of 4 and two others each.
        let indices = rows::<2>((0..220).map(|k| 60 * (k / 22) + 2 * (k % 22)));
        let mut order: Vec<u32> = (0..220).collect();
        let (mut runs, mut scratch) = (Runs::default(), Scratch::default());
        arrange(&mut order, 0, &indices, &mut runs, &mut scratch);
        assert_eq!(runs.divide(0..220), [0..160, 160..192, 192..220]);
        assert_eq!(runs.divide(16..160), [16..160, 160..160, 160..160]);
        assert_eq!(runs.divide(7..7), [7..7, 7..7, 7..7]);
        // A second tile, whose runs follow.
        let mut order: Vec<u32> = (0..220).collect();
        arrange(&mut order, 220, &indices, &mut runs, &mut scratch);
        assert_eq!(runs.divide(220..440), [220..380, 380..412, 412..440]);
        assert_eq!(runs.divide(0..440), [0..440, 440..440, 440..440]);
    }
}
