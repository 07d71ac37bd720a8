//! Greedy first-fit on vertex bitmasks, 64 colors to a round.

use crate::sort::{self, INDEX_LIMIT, check_constraint_count, filled};
use crate::{ColoringError, Groups};

/// Colors of one round: the bits of a vertex mask.
const ROUND: usize = u64::BITS as usize;

/// Colors constraints over `N` vertices each by greedy first-fit: in the order given, each constraint takes the
/// lowest color that no earlier constraint with a common vertex has.
///
/// A constraint never needs more than `1 + N·(d − 1)` colors, where `d` is the largest number of constraints at one
/// vertex. The number of colors is not limited.
///
/// # Method
/// Each vertex carries a mask of 64 bits with the colors of its constraints so far; a constraint takes the lowest bit
/// that is clear in the union of its vertices' masks. A constraint that finds all 64 taken is deferred to a next round
/// with fresh masks, which stand for the next 64 colors.
///
/// This is first-fit without a limit. A deferred constraint has an earlier neighbor in each of the 64 colors of its
/// round, so first-fit too gives it a later one; and as it takes none of these 64, it takes none from the
/// constraints after it. Hence the colors of a round are those of first-fit, and first-fit among the deferred
/// constraints, which come in their original order, gives the rest.
///
/// # Cost
/// One pass over the constraints for each 64 colors; 8 bytes per vertex and 1 byte per constraint besides the result.
/// A constraint list in which one vertex has `d` constraints costs at least `d²/128` mask look-ups.
///
/// # Errors
/// [`ColoringError::VertexOutOfRange`], [`ColoringError::RepeatedVertex`], [`ColoringError::TooManyConstraints`],
/// [`ColoringError::TooManyVertices`] and [`ColoringError::OutOfMemory`].
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

    // What a round defers lies, in ascending order, at the end of `order`: the next round sorts it in its place.
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
            // Out of range is out of question: the first round has seen every vertex.
            *color = first_fit(&mut masks, &constraints[i as usize]).unwrap_or(ROUND as u8);
            counts[usize::from(*color)] += 1;
        }
        let keys = colors.iter().map(|&color| usize::from(color));
        sort::by_key(deferred.iter().copied(), keys, &counts, &mut groups.order[start..]);
        groups.close_round(&counts[..ROUND]);
    }
    Ok(groups)
}

/// Takes the lowest color that is free at all `vertices`, or [`ROUND`] if none is; `None` if a vertex is out of range.
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
