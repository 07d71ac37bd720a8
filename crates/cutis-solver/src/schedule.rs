//! What a frame executes, as plain data: every backend runs the same sweeps in the same order.

use cutis_coloring::Groups;
use cutis_constraints::Scalar;

use crate::{Kind, Settings};

/// One color of one kind: constraints `start..end` of that kind may be projected in any order, or at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sweep {
    /// Kind, counted in the order the kinds were added.
    pub kind: usize,
    /// Color of that kind.
    pub color: usize,
    /// First constraint.
    pub start: usize,
    /// One past the last.
    pub end: usize,
}

/// One color of the vertices that move: they may be moved in any order, or at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ColorPass {
    /// Color.
    pub color: usize,
    /// First vertex, in the order of the groups.
    pub start: usize,
    /// One past the last.
    pub end: usize,
}

/// A frame: `substeps` times { predict and move handles; `iterations` times { the sweeps in order, or the color passes of the iteration };
/// update velocities }.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Schedule {
    /// Substeps of a frame.
    pub substeps: u32,
    /// Iterations of a substep.
    pub iterations: u32,
    /// What one iteration projects, in order. Empty colors are left out. None in vertex block descent.
    pub sweeps: Vec<Sweep>,
    /// All colors of the vertices that move, in order, in vertex block descent; none elsewhere. See [`color_passes_of`](Self::color_passes_of).
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
        let there = groups.offsets.windows(2).enumerate().map(pass).filter(|pass| pass.start < pass.end);
        let Settings { substeps, iterations, .. } = *settings;
        Self { substeps, iterations, sweeps: Vec::new(), color_passes: there.collect() }
    }

    /// The color passes of an iteration of vertex block descent, counted from 0, in order: all colors twice. Of all passes over the
    /// colors in a substep the first half goes there and the second half back, so that a substep is symmetric: see the top
    /// of `descent.rs`.
    pub fn color_passes_of(&self, iteration: u32) -> impl Iterator<Item = &ColorPass> {
        let sweep = |number: u64| {
            let back = number >= u64::from(self.iterations);
            let count = self.color_passes.len();
            (0..count).map(move |n| &self.color_passes[if back { count - 1 - n } else { n }])
        };
        let first = 2 * u64::from(iteration);
        sweep(first).chain(sweep(first + 1))
    }

    /// Projections of one frame; in vertex block descent, steps of a vertex.
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
    fn half_of_a_substeps_passes_go_there_and_half_back() {
        let groups = Groups { order: vec![4, 2, 7], offsets: vec![0, 1, 3] };
        let settings = Settings { iterations: 3, ..Settings::default() };
        let schedule = Schedule::of_vertices(&groups, &settings);
        let colors =
            |iteration| schedule.color_passes_of(iteration).map(|pass| pass.color).collect::<Vec<_>>();
        assert_eq!([colors(0), colors(1), colors(2)], [[0, 1, 0, 1], [0, 1, 1, 0], [1, 0, 1, 0]]);
    }
}
