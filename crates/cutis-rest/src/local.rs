//! Local relaxation between the steps of a search.
//!
//! A lip that folds or slides moves far in steps that do not shrink, while the rest of the body
//! waits: each of these steps costs as much as one of the whole body. So vertices that moved much
//! farther than the others come to rest by themselves, with all others held (nonlinear elimination:
//! Lanzkron, Rose and Wilkes, SIAM J. Sci. Comput. 17, 1996). This lowers the energy of the body.
//! It also saves steps where nothing slides: what a full step leaves is mostly quadratic in the
//! rotations near the wound, where the vertices move far.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::body::FIXED;
use crate::constraints::{Constraints, Subset};
use crate::elements::{Elements, Parts};
use crate::settle::dot;
use crate::symmetric::Neighbors;
use crate::{Body, Options, Search};

/// A vertex moved far if it moved by this many times the root of the mean square.
const FAR: f64 = 3.0;
/// Rings of neighbors that come along.
const RINGS: usize = 3;
/// Largest share of the vertices.
const MOST: f64 = 0.1;
/// When the vertices are at rest.
const OPTIONS: Options = Options { error: 0.1, force: 1e-6, most_steps: 40, most_cycles: 100 };

/// The result of local relaxation.
pub(crate) struct Relaxed {
    /// Places of the vertices that may have moved, among the free ones.
    pub places: Vec<u32>,
    /// Their positions.
    pub x: Vec<Point3<f64>>,
}

impl Body {
    /// Brings the vertices nearer to rest that moved much farther than the others in a step, from
    /// positions `x` of all vertices. `None` if there are none or too many, if a force on them is
    /// not finite, or if no step lowers their energy.
    pub(crate) fn relaxed(&self, x: &[Point3<f64>], step: &[Vector3<f64>]) -> Option<Relaxed> {
        let chosen = self.far(step);
        if chosen.is_empty() || chosen.len() as f64 > MOST * self.free.len() as f64 {
            return None;
        }
        let part = self.part(&chosen, x);
        let mut search = Search::new(&part, &OPTIONS).ok()?;
        while !search.is_at_rest() && search.steps.len() < OPTIONS.most_steps {
            search.step().ok()?;
        }
        let mut x = search.state.x;
        x.truncate(chosen.len());
        Some(Relaxed { places: chosen, x })
    }

    /// Places of the vertices that moved far, and of their neighbors, ascending.
    fn far(&self, step: &[Vector3<f64>]) -> Vec<u32> {
        let mean = dot(step, step) / step.len() as f64;
        let far = |place: &u32| step[*place as usize].norm_squared() > FAR * FAR * mean;
        let mut chosen: Vec<u32> = (0..step.len() as u32).filter(far).collect();
        for _ in 0..RINGS {
            let rings: Vec<u32> =
                chosen.iter().flat_map(|&place| self.neighbors.of(place as usize)).copied().collect();
            chosen.extend(rings);
            chosen.sort_unstable();
            chosen.dedup();
        }
        chosen
    }

    /// The part of a body in which only the vertices at some places can move. They come first, and
    /// then the others of their constraints.
    fn part(&self, chosen: &[u32], x: &[Point3<f64>]) -> Self {
        let mut vertices: Vec<u32> = chosen.iter().map(|&place| self.free[place as usize]).collect();
        let count = vertices.len() as u32;
        let mut number = vec![FIXED; self.place.len()];
        for (n, &v) in vertices.iter().enumerate() {
            number[v as usize] = n as u32;
        }
        let touched: Vec<Vec<u32>> =
            self.kinds.iter().map(|elements| elements.at_vertices(chosen, self.parts, &number)).collect();
        for (elements, touched) in self.kinds.iter().zip(&touched) {
            for &v in touched.iter().flat_map(|&k| elements.vertices(k as usize)) {
                let number = &mut number[v as usize];
                if *number == FIXED {
                    *number = vertices.len() as u32;
                    vertices.push(v);
                }
            }
        }
        let place: Vec<u32> = (0..vertices.len() as u32).map(|n| if n < count { n } else { FIXED }).collect();
        let subset = |(elements, touched): (&Elements, Vec<u32>)| -> Arc<dyn Constraints> {
            Arc::new(Subset::of(elements.kind.clone(), touched, &number))
        };
        let kinds: Vec<_> = self.kinds.iter().zip(touched).map(subset).collect();
        let parts = Parts::of(count as usize, &kinds, &place);
        let divided = |(kind, whole): (Arc<dyn Constraints>, &Elements)| {
            Elements::new(kind, whole.curved, &place, parts)
        };
        let kinds = kinds.into_iter().zip(&self.kinds).map(divided).collect();
        let (mut starts, mut later) = (vec![0], Vec::new());
        for &row in chosen {
            let row = row as usize;
            let numbers = self.neighbors.later(row).iter().map(|&n| number[self.free[n as usize] as usize]);
            later.extend(numbers.filter(|&number| number < count));
            starts.push(later.len());
        }
        Self {
            kinds,
            free: (0..count).collect(),
            place,
            neighbors: Arc::new(Neighbors::from_later(starts, &later)),
            parts,
            weights: chosen.iter().map(|&place| self.weights[place as usize]).collect(),
            origin: self.origin,
            start: vertices.iter().map(|&v| x[v as usize]).collect(),
            reach_m: self.reach_m,
            // A part is small.
            #[cfg(feature = "gpu")]
            gpu: None,
        }
    }
}

impl Elements {
    /// The constraints at some vertices, which are at places `chosen` and have a number.
    fn at_vertices(&self, chosen: &[u32], parts: Parts, number: &[u32]) -> Vec<u32> {
        let mut touched: Vec<usize> = chosen.iter().map(|&place| parts.at(place)).collect();
        touched.dedup();
        let inside = |&k: &u32| self.vertices(k as usize).iter().any(|&v| number[v as usize] != FIXED);
        let of_part = |&part: &usize| self.of_part(part).par_iter().copied().filter(inside);
        let mut all: Vec<u32> = touched.par_iter().flat_map(of_part).collect();
        all.sort_unstable();
        all.dedup();
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::energy::State;
    use crate::springs::block;

    /// One vertex is far from its place. It returns with its neighbors, and the others stay.
    #[test]
    fn only_the_vertices_that_moved_far_come_to_rest() {
        let body = Body::of(&block(), [0.0; 3]).unwrap();
        let center = body.free.len() / 2;
        let mut step = vec![Vector3::zeros(); body.free.len()];
        step[center] = Vector3::new(0.0, 0.003, 0.0);
        let mut x = body.start.clone();
        x[body.free[center] as usize] += step[center];
        let chosen = body.far(&step);
        assert!(chosen.len() > 20 && chosen.binary_search(&(center as u32)).is_ok(), "{}", chosen.len());
        let part = body.part(&chosen, &x);
        assert!(part.start.len() < body.start.len() / 4, "{}", part.start.len());
        let (whole, own) = (body.at(x.clone()), part.at(part.start.clone()));
        for (&place, force) in chosen.iter().zip(&own.forces) {
            assert!((whole.forces[place as usize] - force).norm() <= 1e-12 * whole.norm, "{place}");
        }
        // The part knows the change of the energy that its vertices cause.
        let vertex = |&place: &u32| body.free[place as usize] as usize;
        let back = |place: &u32| body.start[vertex(place)] - x[vertex(place)];
        let moves: Vec<Vector3<f64>> = chosen.iter().map(back).collect();
        let [of_part, of_whole] = [
            part.difference(&own, &part.moved(&own, &moves, 1.0, State::default())),
            body.difference(&whole, &body.at(body.start.clone())),
        ];
        assert!((of_part / of_whole - 1.0).abs() < 1e-9 && of_part < 0.0, "{of_part} and {of_whole} J");
        let found = body.relaxed(&x, &step).unwrap();
        assert_eq!(found.places, chosen);
        let farthest = |x: &mut dyn Iterator<Item = Point3<f64>>| {
            let from_start = |(x, place): (Point3<f64>, &u32)| (x - body.start[vertex(place)]).norm();
            x.zip(&chosen).map(from_start).fold(0.0, f64::max)
        };
        let before = farthest(&mut chosen.iter().map(|place| x[vertex(place)]));
        let after = farthest(&mut found.x.iter().copied());
        assert!(after < 0.2 * before && after > 0.0, "{after:e} m of {before:e} m");
    }

    /// Evaluating only the parts that are touched gives the bits of evaluating all of them.
    #[test]
    fn few_vertices_that_move_change_few_parts() {
        let body = Body::of(&block(), [0.0; 3]).unwrap();
        assert!(body.parts.count > 1);
        let before = body.at(body.start.clone());
        for place in [0, body.parts.size - 1, body.free.len() - 1] {
            let mut x = body.start.clone();
            x[body.free[place] as usize].y += 0.003;
            let whole = body.at(x.clone());
            let found = body.with_moved(&before, x, &[place as u32]);
            assert!(found.forces == whole.forces && found.forces != before.forces, "{place}");
            let numbers = |state: &State| [state.norm, state.scale, state.floor, state.noise];
            assert_eq!(numbers(&found), numbers(&whole), "{place}");
            assert_eq!(body.difference(&before, &found), body.difference(&before, &whole), "{place}");
            assert!(body.difference(&before, &found) > 0.0, "{place}");
        }
    }

    /// Nothing is relaxed if all vertices move alike.
    #[test]
    fn an_even_step_has_no_far_vertices() {
        let body = Body::of(&block(), [0.0; 3]).unwrap();
        assert!(body.far(&vec![Vector3::new(1.0, 0.0, 0.0); body.free.len()]).is_empty());
        assert!(body.far(&vec![Vector3::zeros(); body.free.len()]).is_empty());
    }
}
