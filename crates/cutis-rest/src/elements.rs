//! The constraints of one kind, by the parts of a body.

use std::sync::Arc;

use rayon::prelude::*;

use crate::blocks::divided;
use crate::body::FIXED;
use crate::constraints::Constraints;

/// Constraints that a thread divides at once.
const CHUNK: usize = 1 << 16;
/// Parts of a large body, and the fewest vertices of a part.
const PARTS: usize = 16;
const FEWEST: usize = 1024;
/// Vertices of a part over the span of its constraints. The constraints across the border between
/// two parts are evaluated twice, and there are fewer of them in larger parts.
const SPANS: usize = 4;
/// Constraints that are tried for their span.
const TRIED: usize = 4096;

/// How the free vertices of a body are divided into parts. A part is what a thread takes at once.
/// The sums of parts are added in order, so that a result does not depend on the number of threads.
#[derive(Clone, Copy)]
pub(crate) struct Parts {
    /// Vertices in each part but the last one.
    pub size: usize,
    pub count: usize,
}

impl Parts {
    /// The parts of a body with so many free vertices, which are at `place`.
    pub fn of(free: usize, kinds: &[Arc<dyn Constraints>], place: &[u32]) -> Self {
        let span = kinds.iter().map(|kind| usual_span(&**kind, place)).max().unwrap_or_default();
        let most = (SPANS * span).max(4 * FEWEST);
        let size = (free / PARTS).clamp(FEWEST, most);
        Self { size, count: free.div_ceil(size) }
    }

    /// The part of the vertex at a place.
    #[inline]
    pub fn at(&self, place: u32) -> usize {
        place as usize / self.size
    }
}

/// The distance between the first and the last place of a constraint, which three of four do not
/// exceed.
fn usual_span(kind: &dyn Constraints, place: &[u32]) -> usize {
    let arity = kind.arity();
    let span = |k: usize| {
        let places = kind.indices()[k * arity..][..arity].iter().map(|&v| place[v as usize]);
        let places = places.filter(|&place| place != FIXED);
        let (low, high) = places.fold((FIXED, 0), |(low, high), place| (low.min(place), high.max(place)));
        high.saturating_sub(low) as usize
    };
    let mut spans: Vec<usize> =
        (0..kind.len()).step_by(kind.len().div_ceil(TRIED).max(1)).map(span).collect();
    spans.sort_unstable();
    spans.get(3 * spans.len() / 4).copied().unwrap_or_default()
}

/// The constraints of one kind at the vertices of each part. The part with the first vertex of a
/// constraint owns it, and other parts with one of its vertices borrow it.
pub(crate) struct Elements {
    pub kind: Arc<dyn Constraints>,
    /// Starts of the parts in `constraints`, and the end of the last one.
    starts: Vec<usize>,
    /// Number of constraints that each part borrows.
    borrowed: Vec<usize>,
    /// The constraints of each part: those that it borrows, and those that it owns. Both are in the
    /// order of their first vertices, so that constraints near each other come near each other.
    constraints: Vec<u32>,
    /// Whether the value is curved as a function of a single vertex.
    pub curved: bool,
}

impl Elements {
    /// Divides the constraints of a kind, whose vertices are at `place`.
    pub fn new(kind: Arc<dyn Constraints>, curved: bool, place: &[u32], parts: Parts) -> Self {
        let (arity, count) = (kind.arity(), kind.len());
        // For each part the constraints that it borrows and those that it owns, after their place.
        let of_chunk = |chunk: usize| {
            let mut lists = vec![[const { Vec::new() }; 2]; parts.count];
            let mut others = Vec::new();
            for n in chunk * CHUNK..((chunk + 1) * CHUNK).min(count) {
                let vertices = &kind.indices()[n * arity..][..arity];
                let places = || vertices.iter().map(|&v| place[v as usize]).filter(|&place| place != FIXED);
                let Some(first) = places().min() else { continue };
                let key = u64::from(first) << 32 | n as u64;
                let owner = parts.at(first);
                lists[owner][1].push(key);
                others.clear();
                others.extend(places().map(|place| parts.at(place)).filter(|&part| part != owner));
                others.sort_unstable();
                others.dedup();
                others.iter().for_each(|&part| lists[part][0].push(key));
            }
            lists
        };
        let chunks: Vec<_> = (0..count.div_ceil(CHUNK)).into_par_iter().map(of_chunk).collect();
        let sorted = |part: usize| {
            let [borrowed, owned] = [0, 1].map(|list| {
                let mut keys: Vec<u64> =
                    chunks.iter().flat_map(|lists| &lists[part][list]).copied().collect();
                keys.sort_unstable();
                keys
            });
            let list: Vec<u32> = borrowed.iter().chain(&owned).map(|&key| key as u32).collect();
            (borrowed.len(), list)
        };
        let (borrowed, lists): (Vec<_>, _) = (0..parts.count).into_par_iter().map(sorted).unzip();
        let (starts, constraints) = joined(lists);
        Self { kind, starts, borrowed, constraints, curved }
    }

    /// The constraints at the vertices of a part. Those that it borrows come first.
    #[inline]
    pub fn of_part(&self, part: usize) -> &[u32] {
        &self.constraints[self.starts[part]..self.starts[part + 1]]
    }

    /// Number of constraints that a part borrows.
    #[inline]
    pub fn borrowed(&self, part: usize) -> usize {
        self.borrowed[part]
    }

    /// The constraints that a part owns.
    #[inline]
    pub fn owned(&self, part: usize) -> &[u32] {
        &self.of_part(part)[self.borrowed[part]..]
    }

    /// The vertices of a constraint.
    #[inline]
    pub fn vertices(&self, k: usize) -> &[u32] {
        let arity = self.kind.arity();
        &self.kind.indices()[k * arity..][..arity]
    }
}

/// Lists one after the other: the start of each one, and the end of the last one.
pub(crate) fn joined(lists: Vec<Vec<u32>>) -> (Vec<usize>, Vec<u32>) {
    let mut starts = vec![0];
    for list in &lists {
        starts.push(starts[starts.len() - 1] + list.len());
    }
    let mut all = vec![0; starts[lists.len()]];
    let pieces = divided(&mut all, lists.iter().map(Vec::len));
    pieces.into_par_iter().zip(lists).for_each(|(to, list)| to.copy_from_slice(&list));
    (starts, all)
}

#[cfg(test)]
mod tests {
    use crate::Body;
    use crate::body::FIXED;
    use crate::springs::block;

    /// Each part has all constraints at its vertices, and one part owns each constraint.
    #[test]
    fn parts_share_constraints_with_one_owner() {
        let body = Body::of(&block(), [0.0; 3]).unwrap();
        let parts = body.parts;
        assert!(parts.count > 3, "{}", parts.count);
        for elements in &body.kinds {
            let mut owners = vec![0; elements.kind.len()];
            let touches = |k: usize, part: usize| {
                let places = elements.vertices(k).iter().map(|&v| body.place[v as usize]);
                places.filter(|&place| place != FIXED).any(|place| parts.at(place) == part)
            };
            for part in 0..parts.count {
                let expected = (0..owners.len()).filter(|&k| touches(k, part));
                let mut found: Vec<usize> = elements.of_part(part).iter().map(|&k| k as usize).collect();
                found.sort_unstable();
                assert!(found.into_iter().eq(expected), "part {part}");
                elements.owned(part).iter().for_each(|&k| owners[k as usize] += 1);
                let (borrowed, _) = elements.of_part(part).split_at(elements.borrowed(part));
                let before = |&k: &u32| (0..part).any(|earlier| touches(k as usize, earlier));
                assert!(borrowed.iter().all(before), "part {part}");
                assert!(!elements.owned(part).iter().any(before), "part {part}");
            }
            let is_free = |k: usize| (0..parts.count).any(|part| touches(k, part));
            assert!((0..owners.len()).all(|k| owners[k] == usize::from(is_free(k))));
        }
        // No part has the springs between held vertices.
        let springs = &body.kinds[0];
        let of_parts: usize = (0..parts.count).map(|part| springs.owned(part).len()).sum();
        assert!(of_parts < springs.kind.len());
    }
}
