//! The work of a frame as plain data. Every backend runs the same sweeps in the same order.

use cutis_coloring::Groups;
use cutis_constraints::Scalar;

use crate::{Kind, Settings};

/// One color of one kind. The constraints `start..end` may be projected in any order or in
/// parallel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sweep {
    /// Index of the kind, in the order in which the kinds were added.
    pub kind: usize,
    /// Index of the color within the kind.
    pub color: usize,
    /// First constraint.
    pub start: usize,
    /// One past the last element.
    pub end: usize,
}

/// One color of the moving vertices. They may be moved in any order or in parallel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ColorPass {
    /// Index of the color.
    pub color: usize,
    /// First vertex in the order of the groups.
    pub start: usize,
    /// One past the last element.
    pub end: usize,
}

/// The schedule of a frame. Each of the `substeps` predicts positions, moves handles, runs
/// `iterations` iterations and updates velocities. An iteration is all sweeps in order, or the
/// color passes of vertex block descent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Schedule {
    /// Number of substeps of a frame.
    pub substeps: u32,
    /// Number of iterations of a substep.
    pub iterations: u32,
    /// The projections of one iteration, in order, without empty colors. Empty in vertex block
    /// descent. A backend may divide the colors of a kind into
    /// [tiles](crate::ConstraintSet::tiles), which changes no bit.
    pub sweeps: Vec<Sweep>,
    /// All colors of the moving vertices, in order, without empty colors. Empty except in vertex
    /// block descent. See [`color_passes_of`](Self::color_passes_of).
    pub color_passes: Vec<ColorPass>,
}

impl Schedule {
    pub(crate) fn new<T: Scalar>(kinds: &[Kind<T>], settings: &Settings) -> Self {
        let mut sweeps = Vec::new();
        for (kind, set) in kinds.iter().enumerate() {
            for color in 0..set.colors() {
                let range = set.range(color);
                if !range.is_empty() {
                    sweeps.push(Sweep { kind, color, start: range.start, end: range.end });
                }
            }
        }
        Self {
            substeps: settings.substeps,
            iterations: settings.iterations,
            sweeps,
            color_passes: Vec::new(),
        }
    }

    pub(crate) fn of_vertices(groups: &Groups, settings: &Settings) -> Self {
        let pass = |(color, range): (usize, &[u32])| ColorPass {
            color,
            start: range[0] as usize,
            end: range[1] as usize,
        };
        let color_passes =
            groups.offsets.windows(2).enumerate().map(pass).filter(|pass| pass.start < pass.end);
        let Settings { substeps, iterations, .. } = *settings;
        Self { substeps, iterations, sweeps: Vec::new(), color_passes: color_passes.collect() }
    }

    /// Returns the color passes of an iteration of vertex block descent in order. Iterations are
    /// counted from 0, and each passes over all colors twice. In the first half of a substep the
    /// passes ascend, and in the second half they descend, which makes the sweep of a substep
    /// symmetric. The top of `descent.rs` explains why.
    pub fn color_passes_of(&self, iteration: u32) -> impl Iterator<Item = &ColorPass> {
        let sweep = |number: u64| {
            let descending = number >= u64::from(self.iterations);
            let count = self.color_passes.len();
            (0..count).map(move |n| &self.color_passes[if descending { count - 1 - n } else { n }])
        };
        let first = 2 * u64::from(iteration);
        sweep(first).chain(sweep(first + 1))
    }

    /// Returns the number of projections of one frame, or of vertex steps in vertex block descent.
    pub fn projections_per_frame(&self) -> u64 {
        let sweeps: u64 = self.sweeps.iter().map(|sweep| (sweep.end - sweep.start) as u64).sum();
        let color_passes: u64 = self.color_passes.iter().map(|pass| (pass.end - pass.start) as u64).sum();
        (sweeps + 2 * color_passes) * u64::from(self.substeps) * u64::from(self.iterations)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_passes_of_a_substep_ascend_and_then_descend() {
        let groups = Groups { order: vec![4, 2, 7], offsets: vec![0, 1, 3] };
        let settings = Settings { iterations: 3, ..Settings::default() };
        let schedule = Schedule::of_vertices(&groups, &settings);
        let colors =
            |iteration| schedule.color_passes_of(iteration).map(|pass| pass.color).collect::<Vec<_>>();
        assert_eq!([colors(0), colors(1), colors(2)], [[0, 1, 0, 1], [0, 1, 1, 0], [1, 0, 1, 0]]);
    }
}
