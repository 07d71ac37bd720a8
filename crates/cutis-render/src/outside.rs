//! The air around a body, as runs of voxels along the rows of a grid.

use std::ops::Range;

use rayon::prelude::*;

/// The runs of air of all rows, and which of them are outside the body.
pub struct Outside {
    rows_per_slice: usize,
    /// Runs of each slice.
    slices: Vec<Slice>,
    /// A parent of each run and of the outside, which is number 0. Run `r` has number `r + 1`.
    parents: Vec<u32>,
}

#[derive(Default)]
struct Slice {
    /// Number of runs in the slices before.
    before: usize,
    /// Runs of row `j`: `runs[ends[j - 1]..ends[j]]`, by ascending positions.
    ends: Vec<u32>,
    runs: Vec<Range<u32>>,
}

impl Slice {
    fn row(&self, j: usize) -> Range<usize> {
        let end = |j: usize| self.ends[j] as usize;
        (if j == 0 { 0 } else { end(j - 1) })..end(j)
    }
}

impl Outside {
    /// Finds the air that is connected to the sides of the grid through faces of voxels.
    /// Connections through the two faces across `body_axis` do not count. `is_air` fills the row of
    /// indices `j` and `k`.
    ///
    /// # Panics
    /// If there are 2³² runs or more.
    pub fn new(
        shape: [usize; 3],
        body_axis: usize,
        is_air: impl Fn(usize, usize, &mut [bool]) + Sync,
    ) -> Self {
        let mut slices: Vec<Slice> = (0..shape[2])
            .into_par_iter()
            .map(|k| {
                let mut slice = Slice::default();
                let mut air = vec![false; shape[0]];
                for j in 0..shape[1] {
                    is_air(j, k, &mut air);
                    let mut at = 0;
                    while at < air.len() {
                        let end = end_of_run(&air, at);
                        if air[at] {
                            slice.runs.push(at as u32..end as u32);
                        }
                        at = end;
                    }
                    slice.ends.push(u32::try_from(slice.runs.len()).expect("fewer than 2³² runs"));
                }
                slice
            })
            .collect();
        let mut before = 0;
        for slice in &mut slices {
            slice.before = before;
            before += slice.runs.len();
        }
        let count = u32::try_from(before + 1).expect("fewer than 2³² runs");
        let mut outside = Self { rows_per_slice: shape[1], slices, parents: (0..count).collect() };
        outside.connect(shape, body_axis);
        outside
    }

    /// Gives connected runs a common ancestor.
    fn connect(&mut self, shape: [usize; 3], body_axis: usize) {
        let Self { rows_per_slice, slices, parents } = self;
        for (k, slice) in slices.iter().enumerate() {
            for j in 0..*rows_per_slice {
                let at_side =
                    |at: usize, axis: usize| axis != body_axis && (at == 0 || at + 1 == shape[axis]);
                let whole_row = at_side(j, 1) || at_side(k, 2);
                for run in slice.row(j) {
                    let Range { start, end } = slice.runs[run];
                    if whole_row || at_side(start as usize, 0) || at_side(end as usize - 1, 0) {
                        join(parents, 0, slice.before + run + 1);
                    }
                }
                if j > 0 {
                    overlaps(parents, slice, j, slice, j - 1);
                }
                if k > 0 {
                    overlaps(parents, slice, j, &slices[k - 1], j);
                }
            }
        }
        // Every run becomes a child of its oldest ancestor, which precedes it.
        for run in 0..parents.len() {
            parents[run] = parents[parents[run] as usize];
        }
    }

    /// The runs of outside air in a row, by ascending positions.
    pub fn row(&self, j: usize, k: usize) -> impl Iterator<Item = Range<usize>> + '_ {
        let slice = &self.slices[k];
        let outside = |run: &usize| self.parents[slice.before + run + 1] == 0;
        slice.row(j).filter(outside).map(|run| {
            let Range { start, end } = slice.runs[run];
            start as usize..end as usize
        })
    }
}

/// The end of the run of equal values that begins at an index.
fn end_of_run(values: &[bool], start: usize) -> usize {
    let same = |value: &bool| *value == values[start];
    // Chunks are compared without a branch in between, so that vectors of values are compared.
    let chunks = values[start..].chunks_exact(64);
    let whole = chunks.take_while(|chunk| chunk.iter().fold(true, |all, value| all & same(value))).count();
    let rest = &values[start + 64 * whole..];
    values.len() - rest.len() + rest.iter().position(|value| !same(value)).unwrap_or(rest.len())
}

/// Joins the runs of two rows that overlap.
fn overlaps(parents: &mut [u32], a: &Slice, row_of_a: usize, b: &Slice, row_of_b: usize) {
    let (mut first, mut second) = (a.row(row_of_a), b.row(row_of_b));
    while !first.is_empty() && !second.is_empty() {
        let (one, other) = (&a.runs[first.start], &b.runs[second.start]);
        if one.start < other.end && other.start < one.end {
            join(parents, a.before + first.start + 1, b.before + second.start + 1);
        }
        if one.end < other.end { first.start += 1 } else { second.start += 1 }
    }
}

/// Joins two sets of runs. The smaller number becomes the ancestor.
fn join(parents: &mut [u32], a: usize, b: usize) {
    let (a, b) = (ancestor(parents, a), ancestor(parents, b));
    parents[a.max(b)] = a.min(b) as u32;
}

/// The oldest ancestor. Halves the path to it.
fn ancestor(parents: &mut [u32], mut of: usize) -> usize {
    while parents[of] as usize != of {
        parents[of] = parents[parents[of] as usize];
        of = parents[of] as usize;
    }
    of
}
