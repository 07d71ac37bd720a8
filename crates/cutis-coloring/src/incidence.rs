//! Which constraints a vertex is in: the lists of a kind of constraint, turned round.

use crate::ColoringError;
use crate::sort::{INDEX_LIMIT, filled};

/// The vertices of all constraints of one kind: `arity` of them in a row.
#[derive(Clone, Copy, Debug)]
pub struct Tuples<'a> {
    /// Vertex indices, constraint after constraint.
    pub vertices: &'a [u32],
    /// Vertices of one constraint, 1 or more.
    pub arity: usize,
}

impl<'a> Tuples<'a> {
    /// The constraints of a typed list.
    pub fn of<const N: usize>(constraints: &'a [[u32; N]]) -> Self {
        Self { vertices: constraints.as_flattened(), arity: N }
    }

    /// The vertices of one constraint after the other.
    pub fn iter(self) -> impl Iterator<Item = &'a [u32]> {
        self.vertices.chunks_exact(self.arity.max(1))
    }
}

/// For each vertex its places in the [`Tuples`] of a kind, ascending. A place `p` is vertex `p % arity` of constraint
/// `p / arity`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Incidence {
    starts: Vec<u32>,
    places: Vec<u32>,
}

impl Incidence {
    /// Turns the lists of a kind round: one counting sort, 4 bytes per vertex and per place.
    ///
    /// # Errors
    /// [`ColoringError::VertexOutOfRange`], [`ColoringError::TooManyVertices`], [`ColoringError::TooManyConstraints`] if
    /// the places cannot be numbered in 32 bits, [`ColoringError::OutOfMemory`].
    pub fn new(tuples: Tuples<'_>, vertex_count: usize) -> Result<Self, ColoringError> {
        let Tuples { vertices, arity } = tuples;
        if vertices.len() > INDEX_LIMIT {
            let limit = INDEX_LIMIT / arity.max(1);
            return Err(ColoringError::TooManyConstraints { count: vertices.len() / arity.max(1), limit });
        }
        if vertex_count > INDEX_LIMIT - 1 {
            return Err(ColoringError::TooManyVertices { count: vertex_count, limit: INDEX_LIMIT - 1 });
        }
        // The start of vertex v stands at v + 1 while places are counted and handed out, and at v in the end.
        let mut starts = filled(0u32, vertex_count + 1)?;
        for (place, &vertex) in vertices.iter().enumerate() {
            let Some(count) = starts.get_mut(vertex as usize + 1) else {
                let constraint = place / arity.max(1);
                return Err(ColoringError::VertexOutOfRange { constraint, vertex, vertex_count });
            };
            *count += 1;
        }
        let mut start = 0;
        for next in &mut starts[1..] {
            let count = *next;
            *next = start;
            start += count;
        }
        let mut places = filled(0u32, vertices.len())?;
        for (place, &vertex) in (0..).zip(vertices) {
            let next = &mut starts[vertex as usize + 1];
            places[*next as usize] = place;
            *next += 1;
        }
        Ok(Self { starts, places })
    }

    /// Places of `vertex`, ascending.
    ///
    /// # Panics
    /// If there is no such vertex.
    #[inline]
    pub fn of(&self, vertex: u32) -> &[u32] {
        let v = vertex as usize;
        &self.places[self.starts[v] as usize..self.starts[v + 1] as usize]
    }

    /// Where the places of each vertex start, and at last their number: one entry more than there are vertices.
    pub fn starts(&self) -> &[u32] {
        &self.starts
    }

    /// All places, vertex after vertex.
    pub fn places(&self) -> &[u32] {
        &self.places
    }

    /// Bytes stored.
    pub fn bytes(&self) -> usize {
        size_of_val(self.starts.as_slice()) + size_of_val(self.places.as_slice())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_of_each_vertex_ascend() {
        let edges = [[3, 1], [1, 0], [3, 0]];
        let incidence = Incidence::new(Tuples::of(&edges), 5).unwrap();
        assert_eq!(incidence.of(0), [3, 5]);
        assert_eq!(incidence.of(1), [1, 2]);
        assert_eq!(incidence.of(2), []);
        assert_eq!(incidence.of(3), [0, 4]);
        assert_eq!(incidence.of(4), []);
        let error = Incidence::new(Tuples::of(&edges), 3).unwrap_err();
        assert_eq!(error, ColoringError::VertexOutOfRange { constraint: 0, vertex: 3, vertex_count: 3 });
    }
}
