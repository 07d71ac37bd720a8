//! The constraints of each vertex: the inverse of the vertex lists of a kind of constraint.

use crate::ColoringError;
use crate::sort::{INDEX_LIMIT, filled};

/// The vertices of all constraints of one kind, `arity` vertices per constraint.
#[derive(Clone, Copy, Debug)]
pub struct Tuples<'a> {
    /// Vertex indices, one constraint after the other.
    pub vertices: &'a [u32],
    /// Vertices per constraint, 1 or more.
    pub arity: usize,
}

impl<'a> Tuples<'a> {
    /// Returns the vertices of these constraints as one flat list.
    pub fn of<const N: usize>(constraints: &'a [[u32; N]]) -> Self {
        Self { vertices: constraints.as_flattened(), arity: N }
    }

    /// Iterates over the vertices of each constraint.
    pub fn iter(self) -> impl Iterator<Item = &'a [u32]> {
        self.vertices.chunks_exact(self.arity.max(1))
    }
}

/// The places of each vertex in the [`Tuples`] of a kind, ascending. Place `p` is vertex
/// `p % arity` of constraint `p / arity`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Incidence {
    starts: Vec<u32>,
    places: Vec<u32>,
}

impl Incidence {
    /// Inverts the vertex lists of a kind by one counting sort. Needs 4 bytes per vertex and per
    /// place.
    ///
    /// # Errors
    /// [`ColoringError::VertexOutOfRange`], [`ColoringError::TooManyVertices`],
    /// [`ColoringError::TooManyConstraints`] if the places cannot be numbered in 32 bits, and
    /// [`ColoringError::OutOfMemory`].
    pub fn new(tuples: Tuples<'_>, vertex_count: usize) -> Result<Self, ColoringError> {
        let Tuples { vertices, arity } = tuples;
        if vertices.len() > INDEX_LIMIT {
            let limit = INDEX_LIMIT / arity.max(1);
            return Err(ColoringError::TooManyConstraints { count: vertices.len() / arity.max(1), limit });
        }
        if vertex_count > INDEX_LIMIT - 1 {
            return Err(ColoringError::TooManyVertices { count: vertex_count, limit: INDEX_LIMIT - 1 });
        }
        // While places are counted and assigned, entry v + 1 belongs to vertex v. At the end, entry
        // v is the start of vertex v.
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

    /// Returns the places of `vertex`, ascending.
    ///
    /// # Panics
    /// If `vertex` is out of range.
    #[inline]
    pub fn of(&self, vertex: u32) -> &[u32] {
        let v = vertex as usize;
        &self.places[self.starts[v] as usize..self.starts[v + 1] as usize]
    }

    /// Start of each vertex's places, followed by their number: one entry more than there are
    /// vertices.
    pub fn starts(&self) -> &[u32] {
        &self.starts
    }

    /// Returns all places, one vertex after the other.
    pub fn places(&self) -> &[u32] {
        &self.places
    }

    /// Stored bytes.
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
