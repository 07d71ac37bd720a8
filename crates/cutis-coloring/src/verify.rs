//! Checks whether groups are a valid coloring.

use crate::sort::filled;
use crate::{ColoringError, Groups};

impl Groups {
    /// Checks that each constraint is in exactly one group and that no two constraints of a group
    /// share a vertex.
    ///
    /// Needs one pass, 4 bytes per vertex and 1 byte per constraint.
    ///
    /// # Errors
    /// [`ColoringError::Clash`] names the two constraints and the vertex. Other faults are
    /// [`ColoringError::WrongLength`], [`ColoringError::BrokenOffsets`],
    /// [`ColoringError::NotAPermutation`], [`ColoringError::VertexOutOfRange`] and
    /// [`ColoringError::RepeatedVertex`].
    pub fn verify<const N: usize>(
        &self,
        constraints: &[[u32; N]],
        vertex_count: usize,
    ) -> Result<(), ColoringError> {
        let count = constraints.len();
        if self.order.len() != count {
            return Err(ColoringError::WrongLength { order_len: self.order.len(), count });
        }
        self.check_offsets()?;

        let mut seen = filled(false, count)?;
        // For each vertex, the position of its last constraint in the order, plus one.
        let mut last = filled(0u32, vertex_count)?;
        for (group, range) in self.offsets.windows(2).enumerate() {
            let (start, end) = (range[0], range[1]);
            for position in start..end {
                let constraint = self.order[position as usize];
                match seen.get_mut(constraint as usize) {
                    Some(seen) if !*seen => *seen = true,
                    _ => {
                        let position = position as usize;
                        return Err(ColoringError::NotAPermutation { position, constraint, count });
                    }
                }
                for &vertex in &constraints[constraint as usize] {
                    let Some(last) = last.get_mut(vertex as usize) else {
                        let constraint = constraint as usize;
                        return Err(ColoringError::VertexOutOfRange { constraint, vertex, vertex_count });
                    };
                    if *last > start {
                        let first = self.order[*last as usize - 1];
                        return Err(if first == constraint {
                            ColoringError::RepeatedVertex { constraint: constraint as usize, vertex }
                        } else {
                            ColoringError::Clash { group, first, second: constraint, vertex }
                        });
                    }
                    *last = position + 1;
                }
            }
        }
        Ok(())
    }

    pub(crate) fn check_offsets(&self) -> Result<(), ColoringError> {
        let order_len = self.order.len();
        let broken = |position| ColoringError::BrokenOffsets { position, order_len };
        if self.offsets.first() != Some(&0) {
            return Err(broken(0));
        }
        if let Some(i) = self.offsets.windows(2).position(|pair| pair[1] < pair[0]) {
            return Err(broken(i + 1));
        }
        if self.offsets.last().is_none_or(|&end| end as usize != order_len) {
            return Err(broken(self.offsets.len() - 1));
        }
        Ok(())
    }
}
