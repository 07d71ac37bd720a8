//! A set of voxels near each other, as one bit for each voxel of the box around them.

use std::ops::Range;

/// Columns, rows and slices of a box of voxels.
pub type Spans = [Range<usize>; 3];

/// A set of voxels. A voxel has a place: its number in ascending order of slice, row and column.
pub struct VoxelSet {
    /// The box around the voxels.
    bounds: Spans,
    /// Words of a row of the box.
    width: usize,
    words: Vec<u64>,
    /// Number of voxels before each word, and of all.
    before: Vec<usize>,
}

impl VoxelSet {
    /// The voxels of some boxes. `None` if there are none.
    pub fn new(boxes: &[Spans]) -> Option<Self> {
        let boxes = || boxes.iter().filter(|spans| spans.iter().all(|span| !span.is_empty()));
        let bounds = boxes().cloned().reduce(|a, b| {
            std::array::from_fn(|axis| a[axis].start.min(b[axis].start)..a[axis].end.max(b[axis].end))
        })?;
        let width = bounds[0].len().div_ceil(u64::BITS as usize);
        let words = vec![0; width * bounds[1].len() * bounds[2].len()];
        let mut set = Self { bounds, width, words, before: Vec::new() };
        for [columns, rows, slices] in boxes() {
            for k in slices.clone() {
                for j in rows.clone() {
                    for (word, bits) in set.words_of(j, k, columns) {
                        set.words[word] |= bits;
                    }
                }
            }
        }
        let mut count = 0;
        set.before = std::iter::once(0)
            .chain(set.words.iter().map(|word| {
                count += word.count_ones() as usize;
                count
            }))
            .collect();
        Some(set)
    }

    /// The box around the voxels.
    pub fn bounds(&self) -> &Spans {
        &self.bounds
    }

    /// Number of voxels.
    pub fn len(&self) -> usize {
        self.before[self.words.len()]
    }

    /// Column, row and slice of each voxel, in the order of their places.
    pub fn voxels(&self) -> impl Iterator<Item = [usize; 3]> + '_ {
        let [columns, rows, slices] = &self.bounds;
        let rows = slices.clone().flat_map(move |k| rows.clone().map(move |j| [j, k]));
        rows.flat_map(move |[j, k]| self.in_row(j, k, columns).map(move |(_, i)| [i, j, k]))
    }

    /// Place and column of each voxel in some columns of row `j` of slice `k`.
    pub fn in_row(
        &self,
        j: usize,
        k: usize,
        columns: &Range<usize>,
    ) -> impl Iterator<Item = (usize, usize)> + '_ {
        let first_column = self.bounds[0].start;
        self.words_of(j, k, columns).flat_map(move |(word, mask)| {
            let all = self.words[word];
            let first = first_column + word % self.width * u64::BITS as usize;
            bits(all & mask).map(move |bit| {
                let earlier = (all & !(u64::MAX << bit)).count_ones() as usize;
                (self.before[word] + earlier, first + bit)
            })
        })
    }

    /// The words with some columns of a row, and the bits of these columns in each.
    fn words_of(
        &self,
        j: usize,
        k: usize,
        columns: &Range<usize>,
    ) -> impl Iterator<Item = (usize, u64)> + use<> {
        const BITS: usize = u64::BITS as usize;
        let [all, rows, slices] = &self.bounds;
        let inside = rows.contains(&j) && slices.contains(&k);
        let first = columns.start.clamp(all.start, all.end) - all.start;
        let end = if inside { columns.end.clamp(all.start, all.end) - all.start } else { first };
        let row = if inside { self.width * ((k - slices.start) * rows.len() + (j - rows.start)) } else { 0 };
        let words = if first < end { first / BITS..end.div_ceil(BITS) } else { 0..0 };
        words.map(move |word| {
            let (low, high) = (first.max(word * BITS) % BITS, end.min((word + 1) * BITS) - word * BITS);
            (row + word, (u64::MAX << low) & (u64::MAX >> (BITS - high)))
        })
    }
}

/// The numbers of the bits that are set, in ascending order.
pub fn bits(mut mask: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let bit = (mask != 0).then(|| mask.trailing_zeros() as usize);
        mask &= mask.wrapping_sub(1);
        bit
    })
}

#[cfg(test)]
mod tests {
    use cutis_test_kit::Random;

    use super::*;

    #[test]
    fn a_set_has_the_voxels_of_its_boxes_in_ascending_order() {
        let mut random = Random::new(5);
        let mut span = |most: usize| {
            let start = random.below(most);
            start..start + random.below(1 + most / 2)
        };
        let mut found = 0;
        for round in 0..50 {
            let boxes: Vec<Spans> = (0..round % 5).map(|_| [span(150), span(9), span(7)]).collect();
            let is_in = |[i, j, k]: [usize; 3]| {
                boxes.iter().any(|[x, y, z]| x.contains(&i) && y.contains(&j) && z.contains(&k))
            };
            let mut expected = Vec::new();
            for k in 0..12 {
                for j in 0..15 {
                    expected.extend((0..230).map(|i| [i, j, k]).filter(|&voxel| is_in(voxel)));
                }
            }
            let Some(set) = VoxelSet::new(&boxes) else {
                assert!(expected.is_empty());
                continue;
            };
            assert_eq!(set.voxels().collect::<Vec<_>>(), expected);
            assert_eq!(set.len(), expected.len());
            let columns = span(150);
            for (j, k) in (0..15).flat_map(|j| (0..12).map(move |k| (j, k))) {
                let in_row = expected.iter().enumerate();
                let in_row = in_row.filter(|(_, at)| columns.contains(&at[0]) && [at[1], at[2]] == [j, k]);
                let in_row: Vec<_> = in_row.map(|(place, at)| (place, at[0])).collect();
                assert_eq!(set.in_row(j, k, &columns).collect::<Vec<_>>(), in_row);
                found += in_row.len();
            }
        }
        assert!(found > 1000, "{found}");
    }

    #[test]
    fn bits_are_listed_in_ascending_order() {
        assert_eq!(bits(0b1010_0001).collect::<Vec<_>>(), [0, 5, 7]);
        assert_eq!(bits(0).count(), 0);
        assert_eq!(bits(u64::MAX).count(), 64);
    }
}
