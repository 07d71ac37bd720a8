//! Runs: vertices whose constraints follow each other in memory.
//!
//! In a lattice, the next vertex of a color usually has the same constraints as the one before,
//! each one place farther in its color, or a few. Four such vertices are a run. Vertex block
//! descent then reads the incidences of the first two vertices only, and constraints one place
//! apart as one block. Runs are found in the incidences, without knowledge of a lattice. They
//! change no result.

use std::collections::HashMap;

use cutis_coloring::{Groups, Incidence};

/// Number of vertices of a run.
pub(crate) const RUN: usize = 4;

/// Largest distance of the constraints of a run.
const MOST_STEP: u32 = 8;

/// Number of vertices of a chunk, and so of entries in a [`Plan`]. Results do not depend on it.
pub(crate) const VERTEX_CHUNK: usize = if cfg!(miri) { RUN } else { 128 };

/// The runs of a system, by their first vertices.
#[derive(Clone, Debug, Default)]
pub struct Runs {
    /// For each vertex: 0, or 1 + the number of the pattern of the run that starts here.
    starts: Vec<u8>,
    /// Distance between the vertices of a run, for each pattern.
    strides: Vec<u32>,
}

impl Runs {
    /// Finds runs of `vertices` vertices in the order of the groups. `incidences` are those of all
    /// kinds, with their arities.
    pub(crate) fn find(
        vertices: usize,
        groups: &Groups,
        incidences: &[Incidence],
        arities: &[usize],
    ) -> Self {
        let mut runs = Self { starts: vec![0; vertices], strides: Vec::new() };
        let mut patterns: HashMap<Vec<u32>, u8> = HashMap::new();
        for color in groups.offsets.windows(2) {
            let order = &groups.order[color[0] as usize..color[1] as usize];
            let mut at = 0;
            while let Some(run) = order.get(at..at + RUN) {
                if follow(run, incidences, arities) {
                    let (stride, pattern) = (run[1] - run[0], pattern(run, incidences, arities));
                    let next = u8::try_from(patterns.len() + 1).unwrap_or(0);
                    let number = *patterns.entry(pattern).or_insert(next);
                    if number as usize > runs.strides.len() {
                        runs.strides.push(stride);
                    }
                    runs.starts[run[0] as usize] = number;
                    at += RUN;
                } else {
                    at += 1;
                }
            }
        }
        runs
    }

    /// Forgets the runs that contain one of some vertices.
    pub(crate) fn forget(&mut self, vertices: impl Iterator<Item = u32>) {
        for vertex in vertices {
            for pattern in 1..=self.strides.len() {
                let stride = self.strides[pattern - 1];
                for back in 0..RUN as u32 {
                    let first = back.checked_mul(stride).and_then(|back| vertex.checked_sub(back));
                    if let Some(start) = first.and_then(|first| self.starts.get_mut(first as usize))
                        && usize::from(*start) == pattern
                    {
                        *start = 0;
                    }
                }
            }
        }
    }

    /// The runs among the vertices of a chunk, and the other vertices.
    pub(crate) fn plan(&self, indices: &[u32]) -> Plan {
        let mut plan = Plan {
            runs: [(0, 0); VERTEX_CHUNK / RUN],
            run_count: 0,
            others: [0; VERTEX_CHUNK],
            other_count: 0,
        };
        let mut at = 0;
        while at < indices.len() {
            let pattern = self.starts.get(indices[at] as usize).copied().unwrap_or(0);
            if pattern > 0 && self.holds(pattern, &indices[at..]) {
                plan.runs[plan.run_count] = (pattern, at as u16);
                plan.run_count += 1;
                at += RUN;
            } else {
                plan.others[plan.other_count] = at as u16;
                plan.other_count += 1;
                at += 1;
            }
        }
        plan
    }

    /// True if `indices` starts with the vertices of the run that its first vertex starts.
    fn holds(&self, pattern: u8, indices: &[u32]) -> bool {
        let stride = self.strides[usize::from(pattern) - 1];
        let steps = indices.windows(2).take(RUN - 1);
        indices.len() >= RUN && steps.into_iter().all(|pair| pair[1].wrapping_sub(pair[0]) == stride)
    }

    /// Memory in bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.starts.len() + size_of_val(self.strides.as_slice())
    }
}

/// Positions of runs and of other vertices within a chunk.
pub struct Plan {
    runs: [(u8, u16); VERTEX_CHUNK / RUN],
    run_count: usize,
    others: [u16; VERTEX_CHUNK],
    other_count: usize,
}

impl Plan {
    /// The runs in ascending order, as patterns and positions of their first vertices.
    pub(crate) fn runs(&self) -> &[(u8, u16)] {
        &self.runs[..self.run_count]
    }

    /// The positions of the other vertices in ascending order.
    pub(crate) fn others(&self) -> &[u16] {
        &self.others[..self.other_count]
    }
}

/// True if the vertices have one distance, and so have their constraints.
fn follow(run: &[u32], incidences: &[Incidence], arities: &[usize]) -> bool {
    let stride = run[1].wrapping_sub(run[0]);
    run.windows(2).all(|pair| pair[1].wrapping_sub(pair[0]) == stride)
        && incidences.iter().zip(arities).all(|(incidence, &arity)| {
            let places: [&[u32]; RUN] = std::array::from_fn(|n| incidence.of(run[n]));
            places.iter().all(|own| own.len() == places[0].len())
                && (0..places[0].len()).all(|n| {
                    let step = places[1][n].wrapping_sub(places[0][n]);
                    let even = places.windows(2).all(|pair| pair[1][n].wrapping_sub(pair[0][n]) == step);
                    even && step.is_multiple_of(arity as u32) && step / arity as u32 <= MOST_STEP
                })
        })
}

/// What two runs must have in common to be processed together: the distance of their vertices, and
/// for each kind the positions of a vertex in its constraints, and the distances of these.
fn pattern(run: &[u32], incidences: &[Incidence], arities: &[usize]) -> Vec<u32> {
    let mut pattern = vec![run[1] - run[0]];
    for (incidence, &arity) in incidences.iter().zip(arities) {
        let [places, next] = [0, 1].map(|n| incidence.of(run[n]));
        pattern.push(places.len() as u32);
        pattern.extend(places.iter().map(|&place| place % arity as u32));
        pattern.extend(places.iter().zip(next).map(|(&place, &next)| next - place));
    }
    pattern
}

#[cfg(test)]
mod tests {
    use cutis_coloring::Tuples;

    use super::*;

    /// A chain of edges in the order of two colors.
    fn chain(vertices: u32) -> (Groups, Incidence) {
        let edges: Vec<[u32; 2]> = (0..vertices - 1).map(|v| [v, v + 1]).collect();
        let sorted: Vec<[u32; 2]> =
            edges.iter().step_by(2).chain(edges.iter().skip(1).step_by(2)).copied().collect();
        let colors: Vec<u16> = (0..vertices).map(|v| (v % 2) as u16).collect();
        let groups = Groups::from_colors(&colors).unwrap();
        (groups, Incidence::new(Tuples::of(&sorted), vertices as usize).unwrap())
    }

    #[test]
    fn runs_are_found_where_constraints_follow_each_other() {
        let (groups, incidence) = chain(40);
        let runs = Runs::find(40, &groups, &[incidence], &[2]);
        let even: Vec<u32> = (0..40).step_by(2).collect();
        // The first vertex has one edge only, and is no part of a run.
        let plan = runs.plan(&even);
        assert_eq!(plan.runs().iter().map(|run| run.1).collect::<Vec<_>>(), [1, 5, 9, 13]);
        assert_eq!(plan.others(), [0, 17, 18, 19]);
        assert!(plan.runs().iter().all(|run| run.0 == plan.runs()[0].0));
        // Control: with another order of the vertices there is no run.
        let reversed: Vec<u32> = even.iter().rev().copied().collect();
        assert!(runs.plan(&reversed).runs().is_empty());
        assert!(runs.plan(&even[..4]).runs().is_empty(), "a run that is cut off");
    }

    #[test]
    fn most_vertices_of_a_lattice_are_in_runs() {
        let lattice = cutis_test_kit::Kuhn::new([48, 5, 5], 1.0);
        let sorted = |tuples: &[[u32; 4]], colors: &[u16]| -> Vec<[u32; 4]> {
            let groups = Groups::from_colors(colors).unwrap();
            groups.order.iter().map(|&k| tuples[k as usize]).collect()
        };
        let tets = sorted(&lattice.tets, &lattice.tet_colors);
        let count = lattice.positions.len();
        let incidence = Incidence::new(Tuples::of(&tets), count).unwrap();
        let sum = |p: &nalgebra::Point3<f64>| (p.x + p.y + p.z).round() as u16 % 4;
        let colors: Vec<u16> = lattice.positions.iter().map(sum).collect();
        let groups = Groups::from_colors(&colors).unwrap();
        let runs = Runs::find(count, &groups, &[incidence], &[4]);
        let starts = runs.starts.iter().filter(|&&start| start > 0).count();
        assert!(RUN * starts * 10 > 7 * count, "{starts} runs of {count} vertices");
    }

    #[test]
    fn a_body_without_constraints_has_runs_too() {
        let groups = Groups { order: vec![0, 1, 2, 3], offsets: vec![0, 4] };
        let runs = Runs::find(4, &groups, &[], &[]);
        assert_eq!(runs.plan(&groups.order).runs().len(), 1);
        assert!(
            Runs::find(0, &Groups { order: vec![], offsets: vec![0] }, &[], &[]).plan(&[]).runs().is_empty()
        );
    }

    #[test]
    fn runs_of_changed_vertices_are_forgotten() {
        let (groups, incidence) = chain(40);
        let mut runs = Runs::find(40, &groups, &[incidence], &[2]);
        runs.forget([14].into_iter());
        let even: Vec<u32> = (0..40).step_by(2).collect();
        assert_eq!(runs.plan(&even).runs().iter().map(|run| run.1).collect::<Vec<_>>(), [1, 9, 13]);
    }
}
