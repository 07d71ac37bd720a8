//! What a loop over long pieces of constraints reads for each of them.
//!
//! A large body has more indices and parameters than a cache holds. But the indices of a piece
//! follow from those of its first constraint. And in a lattice many pieces have the same
//! parameters, because a rest length along the rows is the same in each row. Such pieces read the
//! parameters of the first of them, which stay in the cache.

use std::collections::HashMap;

use cutis_constraints::{Params, Scalar};

use super::ROW;

/// A long piece: [`ROW`] constraints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Row<const N: usize> {
    /// The vertices of the first constraint.
    pub(super) first: [u32; N],
    /// The place of the parameters of the first constraint. Those of the others follow.
    pub(super) params: u32,
}

/// Returns the pieces that start at `places`, of constraints with these vertices and parameters.
pub(super) fn rows<const N: usize, T: Scalar, P: Params<T>>(
    places: impl Iterator<Item = usize>,
    indices: &[[u32; N]],
    params: &[P],
) -> Vec<Row<N>> {
    // Equal numbers with other bits, such as -0, are different parameters.
    let mut known: HashMap<&[u8], u32> = HashMap::new();
    places
        .map(|place| {
            let bits = bytemuck::cast_slice(P::flat(&params[place..place + ROW]));
            Row { first: indices[place], params: *known.entry(bits).or_insert(place as u32) }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_with_the_same_parameters_share_them() {
        let indices: Vec<[u32; 2]> = (0..5 * ROW as u32).map(|k| [2 * k, 2 * k + 1]).collect();
        let mut params: Vec<[f32; 1]> = (0..5 * ROW).map(|k| [(k % ROW) as f32]).collect();
        let places = || (0..5).map(|piece| piece * ROW);
        let params_of = |params: &[[f32; 1]]| {
            let rows = rows(places(), &indices, params);
            assert!(rows.iter().zip(places()).all(|(row, place)| row.first == indices[place]));
            rows.iter().map(|row| row.params as usize / ROW).collect::<Vec<_>>()
        };
        assert_eq!(params_of(&params), [0; 5]);
        params[2 * ROW] = [-0.0];
        params[4 * ROW - 1] = [7.0];
        assert_eq!(params_of(&params), [0, 0, 2, 3, 0]);
    }
}
