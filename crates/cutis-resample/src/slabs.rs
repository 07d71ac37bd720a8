//! Lists of the tets that reach each slab of slices.

/// Slices of a slab.
pub const SLAB: usize = 4;

/// For each slab the tets that reach it, in ascending order.
pub struct Slabs {
    offsets: Vec<usize>,
    order: Vec<u32>,
}

impl Slabs {
    /// Sorts the tets `0..count` into the slabs of a grid with this number of slices. `heights`
    /// gives the lowest and the highest slice index of a tet, or `None` for a tet to skip.
    pub fn new(count: usize, slices: usize, heights: impl Fn(usize) -> Option<[f64; 2]>) -> Self {
        let slabs = slices.div_ceil(SLAB);
        let last = slices as f64 - 1.0;
        let reached = |tet: usize| {
            let [low, high] = heights(tet)?;
            if high < 0.0 || low > last {
                return None;
            }
            let slab = |slice: f64| slice.clamp(0.0, last) as usize / SLAB;
            Some(slab(low.ceil())..slab(high.floor()) + 1)
        };
        let mut offsets = vec![0; slabs + 1];
        (0..count).filter_map(reached).flatten().for_each(|slab| offsets[slab + 1] += 1);
        (0..slabs).for_each(|slab| offsets[slab + 1] += offsets[slab]);
        let (mut next, mut order) = (offsets.clone(), vec![0; offsets[slabs]]);
        for tet in 0..count {
            for slab in reached(tet).into_iter().flatten() {
                order[next[slab]] = tet as u32;
                next[slab] += 1;
            }
        }
        Self { offsets, order }
    }

    /// Number of slabs.
    pub fn len(&self) -> usize {
        self.offsets.len() - 1
    }

    /// The tets of a slab in ascending order.
    pub fn tets(&self, slab: usize) -> &[u32] {
        &self.order[self.offsets[slab]..self.offsets[slab + 1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slabs_list_the_tets_that_reach_their_slices() {
        let heights = [[0.5, 3.5], [3.9, 4.1], [-9.0, 99.0], [-3.0, -0.1], [8.2, 9.0], [2.0, 2.0]];
        let slabs = Slabs::new(heights.len(), 9, |tet| (tet != 5).then_some(heights[tet]));
        assert_eq!(slabs.len(), 3);
        assert_eq!([slabs.tets(0), slabs.tets(1), slabs.tets(2)], [&[0, 2][..], &[1, 2], &[2]]);
    }
}
