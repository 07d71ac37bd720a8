//! Greedy first-fit on bit masks of the vertices, in rounds of 64 colors.

use crate::sort::{self, INDEX_LIMIT, check_constraint_count, filled};
use crate::{ColoringError, Groups};

/// Colors per round: the number of bits in a vertex mask.
const ROUND: usize = u64::BITS as usize;

/// Colors constraints over `N` vertices by greedy first-fit: in the given order, each constraint
/// takes the lowest color that no earlier constraint with a common vertex has.
///
/// A constraint needs at most `1 + N·(d − 1)` colors, where `d` is the largest number of
/// constraints at one vertex. The number of colors is not limited.
///
/// # Method
/// Each vertex has a mask of 64 bits with the colors of its constraints so far. A constraint takes
/// the lowest bit that is clear in the union of its vertices' masks. A constraint that finds all 64
/// bits set is deferred to the next round. That round uses fresh masks, which stand for the next 64
/// colors.
///
/// The result equals first-fit without a limit. A deferred constraint has an earlier neighbor in
/// each of the 64 colors of its round, so first-fit would also give it a later color. It takes none
/// of these 64 colors away from the constraints after it. The colors of a round are therefore those
/// of first-fit. The deferred constraints keep their order, and the next rounds apply first-fit to
/// them.
///
/// # Cost
/// One pass over the constraints for each 64 colors; 8 bytes per vertex and 1 byte per constraint
/// in addition to the result. If one vertex has `d` constraints, there are at least `d²/128` mask
/// look-ups.
///
/// # Errors
/// [`ColoringError::VertexOutOfRange`], [`ColoringError::RepeatedVertex`],
/// [`ColoringError::TooManyConstraints`], [`ColoringError::TooManyVertices`] and
/// [`ColoringError::OutOfMemory`].
pub fn greedy<const N: usize>(
    constraints: &[[u32; N]],
    vertex_count: usize,
) -> Result<Groups, ColoringError> {
    check_constraint_count(constraints.len())?;
    if vertex_count > INDEX_LIMIT {
        return Err(ColoringError::TooManyVertices { count: vertex_count, limit: INDEX_LIMIT });
    }
    let mut masks = filled(0u64, vertex_count)?;
    let mut colors = filled(0u8, constraints.len())?;
    let mut counts = [0u32; ROUND + 1];
    for (i, vertices) in constraints.iter().enumerate() {
        check_distinct(i, vertices)?;
        let color = first_fit(&mut masks, vertices).ok_or_else(|| out_of_range(i, vertices, vertex_count))?;
        colors[i] = color;
        counts[usize::from(color)] += 1;
    }

    let mut groups = Groups { order: filled(0u32, constraints.len())?, offsets: vec![0] };
    let keys = colors.iter().map(|&color| usize::from(color));
    sort::by_key(0..constraints.len() as u32, keys, &counts, &mut groups.order);
    groups.close_round(&counts[..ROUND]);

    // The deferred constraints are at the end of `order`, in ascending order. The next round sorts
    // them in place.
    while counts[ROUND] > 0 {
        let start = groups.order.len() - counts[ROUND] as usize;
        let deferred = groups.order[start..].to_vec();
        for &i in &deferred {
            for &v in &constraints[i as usize] {
                masks[v as usize] = 0;
            }
        }
        counts.fill(0);
        for (color, &i) in colors.iter_mut().zip(&deferred) {
            // No vertex is out of range, because the first round has checked them all.
            *color = first_fit(&mut masks, &constraints[i as usize]).unwrap_or(ROUND as u8);
            counts[usize::from(*color)] += 1;
        }
        let keys = colors.iter().map(|&color| usize::from(color));
        sort::by_key(deferred.iter().copied(), keys, &counts, &mut groups.order[start..]);
        groups.close_round(&counts[..ROUND]);
    }
    Ok(groups)
}

/// Takes the lowest color that is free at all `vertices`, or [`ROUND`] if none is free. `None` if a
/// vertex is out of range.
#[inline(always)]
fn first_fit<const N: usize>(masks: &mut [u64], vertices: &[u32; N]) -> Option<u8> {
    let mut taken = 0;
    for &v in vertices {
        taken |= masks.get(v as usize)?;
    }
    let color = taken.trailing_ones();
    let bit = 1u64.checked_shl(color).unwrap_or(0);
    for &v in vertices {
        masks[v as usize] |= bit;
    }
    Some(color as u8)
}

fn check_distinct<const N: usize>(constraint: usize, vertices: &[u32; N]) -> Result<(), ColoringError> {
    for (a, &vertex) in vertices.iter().enumerate() {
        if vertices[..a].contains(&vertex) {
            return Err(ColoringError::RepeatedVertex { constraint, vertex });
        }
    }
    Ok(())
}

#[cold]
fn out_of_range<const N: usize>(
    constraint: usize,
    vertices: &[u32; N],
    vertex_count: usize,
) -> ColoringError {
    let vertex = vertices.iter().copied().find(|&v| v as usize >= vertex_count).unwrap_or(u32::MAX);
    ColoringError::VertexOutOfRange { constraint, vertex, vertex_count }
}
