//! Groups of vertices for solvers that move one vertex after the other. No two vertices of a group
//! are in one constraint.

use crate::sort::{self, filled};
use crate::{ColoringError, Groups, Incidence, Tuples};

const NONE: u32 = u32::MAX;

/// Colors the moving vertices by greedy first-fit: in ascending order, each takes the lowest color
/// that no earlier vertex in one of its constraints has.
///
/// The result names only the moving vertices. A constraint may have several fixed ones.
///
/// `kinds` and `incidences` have one entry per kind, in the same order. `moves` has one entry per
/// vertex. For each vertex, the function visits every vertex of every constraint that contains it.
/// It needs 4 bytes per vertex and color in addition to the result. The color of a vertex is at
/// most the number of its neighbors.
///
/// # Errors
/// [`ColoringError::OutOfMemory`].
///
/// # Panics
/// If an incidence has fewer vertices than `moves`, or belongs to another kind.
pub fn greedy_vertices(
    kinds: &[Tuples<'_>],
    incidences: &[Incidence],
    moves: &[bool],
) -> Result<Groups, ColoringError> {
    let mut colors = filled(NONE, moves.len())?;
    let mut counts: Vec<u32> = Vec::new();
    // For each color, the last vertex with a neighbor of this color, plus one.
    let mut taken: Vec<u32> = Vec::new();
    let moving = || (0u32..).zip(moves).filter(|(_, moves)| **moves).map(|(v, _)| v);
    for v in moving() {
        for (tuples, incidence) in kinds.iter().zip(incidences) {
            for &place in incidence.of(v) {
                let first = place as usize / tuples.arity * tuples.arity;
                for &other in &tuples.vertices[first..first + tuples.arity] {
                    let color = colors[other as usize];
                    if color != NONE {
                        taken[color as usize] = v + 1;
                    }
                }
            }
        }
        let color = taken.iter().position(|&last| last != v + 1).unwrap_or(taken.len());
        if color == taken.len() {
            taken.push(0);
            counts.push(0);
        }
        colors[v as usize] = color as u32;
        counts[color] += 1;
    }
    let mut groups = Groups { order: filled(0, moving().count())?, offsets: vec![0] };
    sort::by_key(moving(), moving().map(|v| colors[v as usize] as usize), &counts, &mut groups.order);
    groups.close_round(&counts);
    Ok(groups)
}

impl Groups {
    /// Returns the same groups without the fixed vertices. Groups that become empty are removed.
    pub fn restricted_to(&self, moves: &[bool]) -> Self {
        let mut restricted = Groups { order: Vec::new(), offsets: vec![0] };
        for group in self.iter() {
            let moving = |vertex: &&u32| moves.get(**vertex as usize) != Some(&false);
            let before = restricted.order.len();
            restricted.order.extend(group.iter().filter(moving));
            restricted.close_round(&[(restricted.order.len() - before) as u32]);
        }
        restricted
    }

    /// Checks that each moving vertex, and no other, is in exactly one group, and that no two
    /// vertices of a group are in one constraint.
    ///
    /// # Errors
    /// [`ColoringError::WrongVertex`], [`ColoringError::VertexClash`] and
    /// [`ColoringError::BrokenOffsets`].
    ///
    /// # Panics
    /// If a constraint names a vertex that `moves` does not have.
    pub fn verify_vertices(&self, kinds: &[Tuples<'_>], moves: &[bool]) -> Result<(), ColoringError> {
        self.check_offsets()?;
        let mut colors = filled(NONE, moves.len())?;
        for (color, range) in (0u32..).zip(self.offsets.windows(2)) {
            for &vertex in &self.order[range[0] as usize..range[1] as usize] {
                let v = vertex as usize;
                if moves.get(v) != Some(&true) || colors[v] != NONE {
                    return Err(ColoringError::WrongVertex { vertex });
                }
                colors[v] = color;
            }
        }
        if let Some(v) = (0..moves.len()).find(|&v| moves[v] && colors[v] == NONE) {
            return Err(ColoringError::WrongVertex { vertex: v as u32 });
        }
        for tuples in kinds {
            for (constraint, tuple) in tuples.iter().enumerate() {
                for (n, &second) in tuple.iter().enumerate() {
                    let color = colors[second as usize];
                    let same = |&&first: &&u32| color != NONE && colors[first as usize] == color;
                    if let Some(&first) = tuple[..n].iter().find(same) {
                        let group = color as usize;
                        return Err(ColoringError::VertexClash { group, first, second, constraint });
                    }
                }
            }
        }
        Ok(())
    }
}
