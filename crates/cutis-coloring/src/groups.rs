//! Groups of constraints: an order of the constraints and the offsets of the groups in it.

use crate::ColoringError;
use crate::sort::{self, check_constraint_count, filled};

/// Constraints divided into groups (colors) so that no two constraints of a group share a vertex.
///
/// The constraints of group `c` are `order[offsets[c]..offsets[c + 1]]`, in ascending order. No
/// group is empty. Groups from this crate have these properties. Use [`verify`](Groups::verify) to
/// check other groups.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Groups {
    /// Constraint indices, group after group.
    pub order: Vec<u32>,
    /// Start of each group in `order`, followed by the number of constraints: one entry more than
    /// there are groups.
    pub offsets: Vec<u32>,
}

impl Groups {
    /// Returns groups from known colors, one per constraint, such as the closed-form colors of a
    /// lattice.
    ///
    /// The groups are in the order of ascending color. Unused colors are skipped. This function
    /// does not check whether the colors are valid; [`verify`](Groups::verify) does.
    ///
    /// # Errors
    /// [`ColoringError::TooManyConstraints`] and [`ColoringError::OutOfMemory`].
    pub fn from_colors(colors: &[u16]) -> Result<Self, ColoringError> {
        check_constraint_count(colors.len())?;
        let mut counts = Vec::new();
        for &color in colors {
            let color = usize::from(color);
            if color >= counts.len() {
                counts.resize(color + 1, 0u32);
            }
            counts[color] += 1;
        }
        let mut groups = Groups { order: filled(0, colors.len())?, offsets: vec![0] };
        let keys = colors.iter().map(|&color| usize::from(color));
        sort::by_key(0..colors.len() as u32, keys, &counts, &mut groups.order);
        groups.close_round(&counts);
        Ok(groups)
    }

    /// Appends a group for each count above 0.
    pub(crate) fn close_round(&mut self, counts: &[u32]) {
        let mut end = self.offsets.last().copied().unwrap_or(0);
        for &count in counts.iter().filter(|&&count| count > 0) {
            end += count;
            self.offsets.push(end);
        }
    }

    /// Returns the number of groups (colors).
    pub fn len(&self) -> usize {
        self.offsets.len().saturating_sub(1)
    }

    /// True if there are no groups, and therefore no constraints.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the constraints of group `color`, in ascending order.
    ///
    /// # Panics
    /// If `color` is not below [`len`](Groups::len).
    pub fn group(&self, color: usize) -> &[u32] {
        &self.order[self.offsets[color] as usize..self.offsets[color + 1] as usize]
    }

    /// Iterates over the groups in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &[u32]> {
        (0..self.len()).map(|color| self.group(color))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_colors_are_sorted_stably_and_unused_ones_skipped() {
        let groups = Groups::from_colors(&[5, 0, 5, 65535, 0]).unwrap();
        assert_eq!(groups.order, [1, 4, 0, 2, 3]);
        assert_eq!(groups.offsets, [0, 2, 4, 5]);
        assert_eq!(groups.iter().map(<[u32]>::len).collect::<Vec<_>>(), [2, 2, 1]);
    }

    #[test]
    fn no_constraint_makes_no_group() {
        let groups = Groups::from_colors(&[]).unwrap();
        assert!(groups.is_empty());
        assert_eq!(groups.offsets, [0]);
        assert_eq!(groups.iter().len(), 0);
    }
}
