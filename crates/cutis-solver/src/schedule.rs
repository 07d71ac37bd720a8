//! What a frame executes, as plain data: every backend runs the same sweeps in the same order.

use cutis_coloring::Groups;
use cutis_constraints::Scalar;

use crate::{Kind, Settings};

/// One colour of one kind: constraints `start..end` of that kind may be projected in any order, or at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sweep {
    /// Kind, counted in the order the kinds were added.
    pub kind: usize,
    /// Colour of that kind.
    pub color: usize,
    /// First constraint.
    pub start: usize,
    /// One past the last.
    pub end: usize,
}

/// One colour of the vertices that move: they may be moved in any order, or at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Turn {
    /// Colour.
    pub color: usize,
    /// First vertex, in the order of the groups.
    pub start: usize,
    /// One past the last.
    pub end: usize,
}

/// A frame: `substeps` times { predict and carry handles; `iterations` times { the sweeps in order, or the turns in order };
/// update velocities }.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Schedule {
    /// Substeps of a frame.
    pub substeps: u32,
    /// Iterations of a substep.
    pub iterations: u32,
    /// What one iteration projects, in order. Empty colours are left out. None in vertex block descent.
    pub sweeps: Vec<Sweep>,
    /// Which vertices one iteration moves, in order, in vertex block descent: all colours there and back. None elsewhere.
    pub turns: Vec<Turn>,
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
        Self { substeps: settings.substeps, iterations: settings.iterations, sweeps, turns: Vec::new() }
    }

    /// There and back, so that an iteration is symmetric: see the top of `descent.rs`.
    pub(crate) fn of_vertices(groups: &Groups, settings: &Settings) -> Self {
        let turn = |(color, range): (usize, &[u32])| Turn {
            color,
            start: range[0] as usize,
            end: range[1] as usize,
        };
        let there = groups.offsets.windows(2).enumerate().map(turn).filter(|turn| turn.start < turn.end);
        let there: Vec<Turn> = there.collect();
        let turns = there.iter().chain(there.iter().rev()).copied().collect();
        let Settings { substeps, iterations, .. } = *settings;
        Self { substeps, iterations, sweeps: Vec::new(), turns }
    }

    /// Projections of one frame; in vertex block descent, steps of a vertex.
    pub fn projections_per_frame(&self) -> u64 {
        let sweeps: u64 = self.sweeps.iter().map(|sweep| (sweep.end - sweep.start) as u64).sum();
        let turns: u64 = self.turns.iter().map(|turn| (turn.end - turn.start) as u64).sum();
        (sweeps + turns) * u64::from(self.substeps) * u64::from(self.iterations)
    }
}
