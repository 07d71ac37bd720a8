//! What a frame executes, as plain data: every backend runs the same sweeps in the same order.

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

/// A frame: `substeps` times { predict and carry handles; `iterations` times { the sweeps in order }; update velocities }.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Schedule {
    /// Substeps of a frame.
    pub substeps: u32,
    /// Iterations of a substep.
    pub iterations: u32,
    /// What one iteration projects, in order. Empty colours are left out.
    pub sweeps: Vec<Sweep>,
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
        Self { substeps: settings.substeps, iterations: settings.iterations, sweeps }
    }

    /// Projections of one frame.
    pub fn projections_per_frame(&self) -> u64 {
        let sweep: u64 = self.sweeps.iter().map(|sweep| (sweep.end - sweep.start) as u64).sum();
        sweep * u64::from(self.substeps) * u64::from(self.iterations)
    }
}
