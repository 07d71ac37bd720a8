//! Hands out the parts of ranges to threads.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Largest number of shares. More threads than that work on the same shares.
const MOST_SHARES: usize = 16;

/// Ranges in shares, one for each worker, and each share in chunks. Each chunk is handed out once.
///
/// A share has the same part of each range. A worker gets the chunks of its own share first, so
/// that what it reads there stays in the cache of its processor.
pub(crate) struct Shares<const RANGES: usize> {
    /// The start of each share in each range, and the end of the last one.
    cuts: [[usize; MOST_SHARES + 1]; RANGES],
    chunk: usize,
    /// Number of shares, and for each of them the number of chunks that were handed out.
    count: usize,
    next: [Counter; MOST_SHARES],
}

/// A counter with a cache line of its own, so that threads do not wait for each other's counters.
#[derive(Default)]
#[repr(align(128))]
struct Counter(AtomicUsize);

impl<const RANGES: usize> Shares<RANGES> {
    /// Divides each of `ranges` into equal parts for `workers` threads. A part starts at a multiple
    /// of `multiple` from the start of its range. A chunk has `chunk` elements of one range, or
    /// what is left of a part.
    ///
    /// # Panics
    /// Panics if `chunk` or `multiple` is 0.
    pub(crate) fn new(ranges: [Range<usize>; RANGES], workers: usize, chunk: usize, multiple: usize) -> Self {
        assert!(chunk > 0 && multiple > 0, "chunks are not empty");
        let count = workers.clamp(1, MOST_SHARES);
        let mut cuts = [[0; MOST_SHARES + 1]; RANGES];
        for (cuts, range) in cuts.iter_mut().zip(ranges) {
            for (share, cut) in cuts[..count].iter_mut().enumerate() {
                *cut = range.start + range.len() * share / count / multiple * multiple;
            }
            cuts[count] = range.end;
        }
        Self { cuts, chunk, count, next: Default::default() }
    }

    /// Returns the next chunk for a worker, of its own share if there is one left. `None` if no
    /// chunk is left at all.
    pub(crate) fn next(&self, worker: usize) -> Option<Range<usize>> {
        let first = worker % self.count;
        (first..self.count).chain(0..first).find_map(|share| {
            let mut number = self.next[share].0.fetch_add(1, Ordering::Relaxed);
            self.cuts.iter().find_map(|cuts| {
                let part = cuts[share]..cuts[share + 1];
                let found = chunk(number, &part, self.chunk);
                number = number.saturating_sub(part.len().div_ceil(self.chunk));
                found
            })
        })
    }

    /// Returns the number of chunks if there were one share, which is about how many threads can
    /// help.
    pub(crate) fn chunks(&self) -> usize {
        self.cuts.iter().map(|cuts| (cuts[self.count] - cuts[0]).div_ceil(self.chunk)).sum()
    }
}

/// Chunk `number` of `range`, which has `size` elements, or the rest. `None` after the last one.
pub(crate) fn chunk(number: usize, range: &Range<usize>, size: usize) -> Option<Range<usize>> {
    let start = range.start + number.saturating_mul(size).min(range.len());
    let end = range.end.min(start.saturating_add(size));
    (start < end).then_some(start..end)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_element_is_in_one_chunk() {
        for (ranges, workers, size, multiple) in [
            ([0..0, 0..0], 1, 4, 1),
            ([3..4, 4..4], 2, 4, 16),
            ([5..900, 900..1000], 1, 7, 1),
            ([5..47, 47..1000], 3, 64, 16),
            ([0..0, 0..999], 40, 10, 2),
        ] {
            let all = ranges[0].start..ranges[1].end;
            let shares = Shares::new(ranges.clone(), workers, size, multiple);
            let mut seen = vec![0; all.end];
            for worker in (0..workers).cycle() {
                let Some(chunk) = shares.next(worker) else { break };
                assert!(chunk.len() <= size && !chunk.is_empty());
                chunk.for_each(|n| seen[n] += 1);
            }
            assert!((0..all.end).all(|n| seen[n] == usize::from(all.contains(&n))), "{ranges:?}");
            assert!((0..workers).all(|worker| shares.next(worker).is_none()));
        }
    }

    #[test]
    fn a_worker_takes_its_own_share_first() {
        let shares = Shares::new([10..110, 110..140], 2, 20, 8);
        let of_second: Vec<_> = std::iter::from_fn(|| shares.next(1)).collect();
        let own = [58..78, 78..98, 98..110, 118..138, 138..140];
        assert_eq!(of_second, [&own[..], &[10..30, 30..50, 50..58, 110..118]].concat());
    }
}
