//! The form of the constraints of a vertex: how many of each kind it has, at which corners it is,
//! and where its neighbors occur again.

use std::collections::HashMap;

use cutis_coloring::Incidence;
use cutis_constraints::Scalar;

use super::MOST_NEIGHBORS;
use crate::Kind;

/// The form of the constraints of a vertex. Neighbors are numbered as they occur.
#[derive(Clone, Debug)]
pub(super) struct Pattern {
    /// Number of vertices in the neighborhood. The first one is the vertex itself.
    pub(super) neighbors: usize,
    /// For each kind, the constraints of a vertex: its corner, then the neighbors at all corners.
    pub(super) entries: Vec<Vec<u8>>,
}

/// The forms of the constraints at the vertices of a color.
#[derive(Default)]
pub(super) struct Forms {
    pub(super) patterns: Vec<Pattern>,
    /// Numbers of the patterns by their signatures: for each kind the number of entries, and the
    /// entries.
    numbers: HashMap<Vec<u8>, u32>,
    /// Number of the pattern of the vertex before, and its signature.
    last: Option<(u32, Vec<u8>)>,
    /// The vertices with each pattern, as places in the color.
    pub(super) of_pattern: Vec<Vec<u32>>,
    /// Start of the neighbors of each vertex, and the end of the last one.
    starts: Vec<usize>,
    /// The vertices in the constraints of each vertex, which is the first one.
    neighbors: Vec<u32>,
}

impl Forms {
    /// Finds the forms of the vertices of a color.
    pub(super) fn find<T: Scalar>(&mut self, vertices: &[u32], kinds: &[Kind<T>], incidences: &[Incidence]) {
        self.of_pattern.iter_mut().for_each(Vec::clear);
        self.starts.clear();
        self.neighbors.clear();
        let mut signature = Vec::new();
        for (place, &vertex) in (0..).zip(vertices) {
            self.starts.push(self.neighbors.len());
            signature.clear();
            if self.sign(vertex, kinds, incidences, &mut signature) {
                let pattern = self.number(&signature, kinds);
                self.of_pattern[pattern as usize].push(place);
            }
        }
        self.starts.push(self.neighbors.len());
    }

    /// Writes the signature and the neighbors of a vertex. False if there are too many.
    fn sign<T: Scalar>(
        &mut self,
        vertex: u32,
        kinds: &[Kind<T>],
        incidences: &[Incidence],
        signature: &mut Vec<u8>,
    ) -> bool {
        let start = self.neighbors.len();
        self.neighbors.push(vertex);
        for (kind, incidence) in kinds.iter().zip(incidences) {
            let (arity, indices, places) = (kind.arity(), kind.indices(), incidence.of(vertex));
            let Ok(count) = u8::try_from(places.len()) else { return false };
            signature.push(count);
            for &place in places {
                let (constraint, corner) = (place as usize / arity, place as usize % arity);
                signature.push(corner as u8);
                for &other in &indices[constraint * arity..(constraint + 1) * arity] {
                    let known = &self.neighbors[start..];
                    let number = known.iter().position(|known| *known == other).unwrap_or(known.len());
                    if number == MOST_NEIGHBORS {
                        return false;
                    }
                    if number == known.len() {
                        self.neighbors.push(other);
                    }
                    signature.push(number as u8);
                }
            }
        }
        true
    }

    /// The number of the pattern with a signature, of the vertex whose neighbors were found last.
    fn number<T: Scalar>(&mut self, signature: &[u8], kinds: &[Kind<T>]) -> u32 {
        // In a row, most vertices have the form of the one before.
        if let Some((number, last)) = &self.last
            && last == signature
        {
            return *number;
        }
        let number = self.numbers.get(signature).copied().unwrap_or_else(|| {
            let number = self.patterns.len() as u32;
            let mut rest = signature;
            let entries = kinds.iter().map(|kind| {
                let (own, after) = rest[1..].split_at(usize::from(rest[0]) * (kind.arity() + 1));
                rest = after;
                own.to_vec()
            });
            let entries = entries.collect();
            let neighbors = self.neighbors.len() - self.starts[self.starts.len() - 1];
            self.patterns.push(Pattern { neighbors, entries });
            self.of_pattern.push(Vec::new());
            self.numbers.insert(signature.to_vec(), number);
            number
        });
        self.last = Some((number, signature.to_vec()));
        number
    }

    /// The neighbors of the vertex at a place.
    pub(super) fn neighbors(&self, place: usize) -> &[u32] {
        &self.neighbors[self.starts[place]..self.starts[place + 1]]
    }
}
