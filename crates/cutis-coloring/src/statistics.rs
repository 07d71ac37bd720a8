//! How well groups fill a parallel machine: their number and sizes.

use crate::Groups;

/// Sizes of groups, in constraints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    /// Number of constraints.
    pub constraints: usize,
    /// Number of groups.
    pub colors: usize,
    /// Size of the smallest group; 0 if there is none.
    pub smallest: usize,
    /// Size of the largest group; 0 if there is none.
    pub largest: usize,
    /// Mean size; 0 if there is no group.
    pub mean: f64,
}

impl Groups {
    /// Number and sizes of the groups.
    pub fn statistics(&self) -> Statistics {
        let sizes = || self.iter().map(<[u32]>::len);
        let colors = self.len();
        let constraints = self.order.len();
        Statistics {
            constraints,
            colors,
            smallest: sizes().min().unwrap_or(0),
            largest: sizes().max().unwrap_or(0),
            mean: if colors == 0 { 0.0 } else { constraints as f64 / colors as f64 },
        }
    }

    /// Share (0 to 1) of the constraints that lie in groups of fewer than `size`; 0 if there is no constraint.
    ///
    /// Groups smaller than what a machine runs at once waste it: greedy colors of a lattice end in such groups.
    pub fn share_in_groups_below(&self, size: usize) -> f64 {
        if self.order.is_empty() {
            return 0.0;
        }
        let below: usize = self.iter().map(<[u32]>::len).filter(|&len| len < size).sum();
        below as f64 / self.order.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_of_uneven_groups() {
        let groups = Groups::from_colors(&[0, 0, 0, 0, 0, 1, 1, 2]).unwrap();
        let statistics = groups.statistics();
        assert_eq!(
            statistics,
            Statistics { constraints: 8, colors: 3, smallest: 1, largest: 5, mean: 8.0 / 3.0 }
        );
        assert_eq!(groups.share_in_groups_below(1), 0.0);
        assert_eq!(groups.share_in_groups_below(3), 3.0 / 8.0);
        assert_eq!(groups.share_in_groups_below(6), 1.0);
    }

    #[test]
    fn nothing_has_no_sizes() {
        let groups = Groups::from_colors(&[]).unwrap();
        let none = Statistics { constraints: 0, colors: 0, smallest: 0, largest: 0, mean: 0.0 };
        assert_eq!(groups.statistics(), none);
        assert_eq!(groups.share_in_groups_below(10), 0.0);
    }
}
