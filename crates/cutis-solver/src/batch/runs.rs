//! Runs: constraints in a row whose vertices advance by one stride.
//!
//! A block is four constraints, one after the other, whose vertices all advance by the same stride:
//! constraint `n` of the block has the vertices of its first constraint plus `n` times the stride.
//! SIMD lanes then read the vertices of a block with one index per corner, and side by side if the
//! stride is 1. Meshes with rows of vertices have such blocks. The constraints of a color may be in
//! any order, so that [`arrange`] puts the blocks of each stride behind each other.

use std::ops::Range;

/// Number of constraints of a block.
pub(super) const BLOCK: usize = 4;

/// The largest stride that counts.
const MOST_STRIDE: usize = 8;

/// The number of constraints of a run is a multiple of this, so that each run fills SIMD lanes of
/// every width.
const RUN: usize = super::MAX_LANES;

/// Constraints from `start` up to the start of the next run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Run {
    start: u32,
    /// 0 if the constraints have no common stride.
    stride: u32,
}

/// The runs of a kind, in ascending order.
#[derive(Clone, Debug, Default)]
pub(super) struct Runs(Vec<Run>);

impl Runs {
    /// Returns the stride of the first constraints in `range`, 0 if they have none, and which ones
    /// have it. Counted from their start, each four of them are a block if the stride is not 0. A
    /// range that starts within a block has no stride up to the next one.
    #[inline]
    pub(super) fn part(&self, range: Range<usize>) -> (usize, Range<usize>) {
        let next = self.0.partition_point(|run| run.start as usize <= range.start);
        let end = self.0.get(next).map_or(range.end, |run| range.end.min(run.start as usize));
        let Some(run) = next.checked_sub(1).map(|last| self.0[last]) else { return (0, range.start..end) };
        match (range.start - run.start as usize) % BLOCK {
            0 => (run.stride as usize, range.start..end),
            _ if run.stride == 0 => (0, range.start..end),
            place => (0, range.start..end.min(range.start + BLOCK - place)),
        }
    }

    /// Returns the memory in bytes.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.0.as_slice())
    }
}

/// Lists of constraints by stride, kept between calls of [`arrange`].
#[derive(Default)]
pub(super) struct Scratch {
    of_stride: [Vec<u32>; MOST_STRIDE + 1],
}

/// Sorts `constraints`, which will be at place `start` of the kind, into runs: first the blocks of
/// stride 1, of stride 2 and so on, then all other constraints in ascending order.
pub(super) fn arrange<const N: usize>(
    constraints: &mut [u32],
    start: usize,
    indices: &[[u32; N]],
    runs: &mut Runs,
    scratch: &mut Scratch,
) {
    let Scratch { of_stride } = scratch;
    of_stride.iter_mut().for_each(Vec::clear);
    let mut place = 0;
    while place < constraints.len() {
        let block = constraints.get(place..place + BLOCK);
        match block.and_then(|block| Some((block, stride(block, indices)?))) {
            Some((block, stride)) => {
                of_stride[stride].extend_from_slice(block);
                place += BLOCK;
            }
            None => {
                of_stride[0].push(constraints[place]);
                place += 1;
            }
        }
    }
    let (others, of_stride) = of_stride.split_first_mut().expect("a list for stride 0");
    let mut filled = 0;
    let mut append = |list: &[u32], stride: usize| {
        if !list.is_empty() {
            runs.0.push(Run { start: (start + filled) as u32, stride: stride as u32 });
            constraints[filled..filled + list.len()].copy_from_slice(list);
            filled += list.len();
        }
    };
    for (list, stride) in of_stride.iter().zip(1..) {
        let (run, rest) = list.split_at(list.len() / RUN * RUN);
        append(run, stride);
        others.extend_from_slice(rest);
    }
    others.sort_unstable();
    append(others, 0);
}

/// The stride of four constraints, if all of their vertices advance by the same small one.
fn stride<const N: usize>(block: &[u32], indices: &[[u32; N]]) -> Option<usize> {
    let first = &indices[block[0] as usize];
    let stride = indices[block[1] as usize].first()?.checked_sub(*first.first()?)?;
    let advances = |(n, &k): (u32, &u32)| {
        let tuple = &indices[k as usize];
        tuple.iter().zip(first).all(|(&vertex, &first)| first.checked_add(n * stride) == Some(vertex))
    };
    let fits = (1..=MOST_STRIDE).contains(&(stride as usize)) && (0..).zip(block).all(advances);
    fits.then_some(stride as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The order of the constraints `0..count`, and how many constraints of each stride there are.
    fn arranged<const N: usize>(indices: &[[u32; N]]) -> (Vec<u32>, [usize; MOST_STRIDE + 1]) {
        let mut order: Vec<u32> = (0..indices.len() as u32).collect();
        let mut runs = Runs::default();
        arrange(&mut order, 0, indices, &mut runs, &mut Scratch::default());
        let (mut counts, mut first) = ([0; MOST_STRIDE + 1], 0);
        while first < indices.len() {
            let (stride, part) = runs.part(first..indices.len());
            counts[stride] += part.len();
            if stride > 0 {
                for block in order[part.clone()].chunks(BLOCK) {
                    let tuples = block.iter().map(|&k| indices[k as usize]);
                    let start = indices[block[0] as usize];
                    let expected = (0..).map(|n| start.map(|vertex| vertex + n * stride as u32));
                    assert!(tuples.eq(expected.take(BLOCK)), "stride {stride}");
                }
            }
            first = part.end;
        }
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
    fn constraints_in_rows_are_runs() {
        for stride in 1..=MOST_STRIDE as u32 {
            let (order, counts) = arranged(&rows::<4>((0..40).map(|k| k * stride)));
            let mut expected = [0; MOST_STRIDE + 1];
            (expected[0], expected[stride as usize]) = (8, 32);
            assert_eq!(counts, expected, "two whole runs and a remainder");
            assert!(order.into_iter().eq(0..40));
        }
    }

    #[test]
    fn other_constraints_are_no_runs() {
        let alone = |indices: &[[u32; 2]]| arranged(indices).1[0] == indices.len();
        assert!(!alone(&rows((0..40).map(|k| 3 * k))), "the check can fail");
        assert!(alone(&rows((0..40).map(|k| 9 * k))), "a long stride");
        assert!(alone(&rows((0..40).rev())), "a stride below zero");
        assert!(alone(&rows((0..40).map(|k| k * k))), "no stride");
        assert!(alone(&(0..40).map(|k| [k, 1000 + 2 * k]).collect::<Vec<_>>()), "two strides");
        assert!(alone(&rows(0..12)), "too few constraints");
        assert!(alone(&[]));
    }

    #[test]
    fn rows_of_any_length_make_blocks_and_a_remainder() {
        // Rows of 11 vertices with gaps have two blocks and three other constraints each.
        let broken = rows::<2>((0..110).map(|k| 20 * (k / 11) + k % 11));
        let (order, counts) = arranged(&broken);
        assert_eq!((counts[0], counts[1]), (30, 80), "five runs of 16");
        assert!(order[80..].is_sorted(), "the remainder is in ascending order");
        // A row of stride 2 between rows of stride 1.
        let mixed = rows::<2>((0..32).chain((0..20).map(|k| 100 + 2 * k)).chain(200..216));
        let (order, counts) = arranged(&mixed);
        assert_eq!((counts[0], counts[1], counts[2]), (4, 48, 16));
        assert_eq!(order[48], 32);
    }

    #[test]
    fn only_a_range_in_step_with_its_blocks_has_a_stride() {
        let indices = rows::<2>(0..32);
        let mut order: Vec<u32> = (0..32).collect();
        let mut runs = Runs::default();
        arrange(&mut order, 100, &indices, &mut runs, &mut Scratch::default());
        assert_eq!(runs.part(100..132), (1, 100..132));
        assert_eq!(runs.part(112..120), (1, 112..120));
        assert_eq!(runs.part(113..120), (0, 113..116));
        assert_eq!(runs.part(116..120), (1, 116..120));
        assert_eq!(runs.part(118..119), (0, 118..119));
        assert_eq!(runs.part(3..120), (0, 3..100), "before the first run");
    }
}
