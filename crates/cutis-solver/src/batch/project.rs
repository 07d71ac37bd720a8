//! The loops over a range of constraints, scalar for the reference and in lanes for the threads.

use std::ops::Range;

use cutis_coloring::Incidence;
use cutis_constraints::{Constraint, Params, Scalar};
use nalgebra::Point3;
use simba::simd::SimdValue;

use super::{Batch, MOST_LANES, Project, Store};
use crate::colored::SharedVertices;
use crate::{Pbd, Rule, Step, Values, Vertex, VertexForce, Xpbd, project};

impl<C: Constraint<N>, const N: usize, T: Scalar> Batch<C, N, T, C::Params<T>> {
    /// Projects one constraint after the other.
    fn one_by_one<S: Store<T>, R: Rule<T>>(
        &self,
        range: Range<usize>,
        store: &mut S,
        rule: R,
        multipliers: &mut [T],
    ) {
        let start = range.start;
        let stiffness = self.stiffness.values();
        for (k, (tuple, params)) in self.indices[range.clone()].iter().zip(&self.params[range]).enumerate() {
            let vertices = tuple.map(|i| store.load(i));
            let x = vertices.map(|v| v.position());
            let w = vertices.map(|v| v.inverse_mass());
            let multiplier = multipliers.get(k).copied().unwrap_or_else(T::zero);
            let done = project::<C, N, T, R>(&x, &w, params, rule, stiffness.at(start + k), multiplier);
            if let Some(multiplier) = multipliers.get_mut(k) {
                *multiplier += done.multiplier;
            }
            for i in 0..N {
                store.store(tuple[i], Vertex::new(x[i] + done.corrections[i], w[i]));
            }
        }
    }

    /// Projects constraints of one color side by side, as many at once as there are lanes, and the rest one by one:
    /// the same bits, since they share no vertex and each lane does what the scalar does.
    fn side_by_side<S: Store<T>, R: Rule<T>, L: Rule<T::Lanes>>(
        &self,
        range: Range<usize>,
        mut store: S,
        rule: R,
        lane_rule: L,
        multipliers: &mut [T],
    ) {
        let lanes = T::Lanes::LANES;
        let stiffness = self.stiffness.values();
        let groups = range.len() / lanes;
        let (mut rest, keeps) = (range.clone(), !multipliers.is_empty());
        for group in 0..groups {
            let first = range.start + group * lanes;
            let tuples = &self.indices[first..first + lanes];
            let params = &self.params[first..first + lanes];
            let mut x = [Point3::origin(); N];
            let mut w = [T::Lanes::splat(T::zero()); N];
            for i in 0..N {
                let column = |axis: usize| T::lanes(|lane| store.load(tuples[lane][i]).component(axis));
                x[i] = Point3::new(column(0), column(1), column(2));
                w[i] = column(3);
            }
            let params = Params::from_fn(|j| T::lanes(|lane| params[lane].as_ref()[j]));
            let stiffness = match stiffness {
                Values::Uniform(value) => T::Lanes::splat(*value),
                Values::Each(values) => T::lanes(|lane| values[first + lane]),
            };
            let offset = group * lanes;
            let multiplier =
                if keeps { T::lanes(|lane| multipliers[offset + lane]) } else { T::Lanes::splat(T::zero()) };
            let done = project::<C, N, T::Lanes, L>(&x, &w, &params, lane_rule, stiffness, multiplier);
            if keeps {
                let sum: T::Lanes = multiplier + done.multiplier;
                for lane in 0..lanes {
                    multipliers[offset + lane] = sum.extract(lane);
                }
            }
            for i in 0..N {
                let moved = x[i] + done.corrections[i];
                for lane in 0..lanes {
                    let position = moved.map(|component| component.extract(lane));
                    store.store(tuples[lane][i], Vertex::new(position, w[i].extract(lane)));
                }
            }
            rest.start = first + lanes;
        }
        let multipliers = if keeps { &mut multipliers[groups * lanes..] } else { multipliers };
        self.one_by_one(rest, &mut store, rule, multipliers);
    }
}

impl<C: Constraint<N>, const N: usize, T: Scalar> Project<T> for Batch<C, N, T, C::Params<T>> {
    fn project(
        &self,
        range: Range<usize>,
        mut vertices: &mut [Vertex<T>],
        step: Step<T>,
        multipliers: &mut [T],
    ) {
        match step {
            Step::Pbd => self.one_by_one(range, &mut vertices, Pbd, multipliers),
            Step::Xpbd { inverse_h_squared } => {
                self.one_by_one(range, &mut vertices, Xpbd { inverse_h_squared }, multipliers);
            }
        }
    }

    fn project_shared(
        &self,
        range: Range<usize>,
        vertices: SharedVertices<'_, T>,
        step: Step<T>,
        multipliers: &mut [T],
    ) {
        match step {
            Step::Pbd => self.side_by_side(range, vertices, Pbd, Pbd, multipliers),
            Step::Xpbd { inverse_h_squared } => {
                let lanes = Xpbd { inverse_h_squared: T::Lanes::splat(inverse_h_squared) };
                self.side_by_side(range, vertices, Xpbd { inverse_h_squared }, lanes, multipliers);
            }
        }
    }

    fn vertex_force(
        &self,
        incidence: &Incidence,
        chosen: &[u32],
        vertices: &[Vertex<T>],
        forces: &mut [VertexForce<T>],
    ) {
        for (&vertex, vertex_force) in chosen.iter().zip(forces) {
            self.force_one_by_one(incidence.of(vertex), &vertices, vertex_force);
        }
    }

    fn pull_shared(
        &self,
        incidence: &Incidence,
        chosen: &[u32],
        vertices: SharedVertices<'_, T>,
        forces: &mut [VertexForce<T>],
    ) {
        let lanes = T::Lanes::LANES;
        let mut places: [&[u32]; MOST_LANES] = [&[]; MOST_LANES];
        for (chosen, forces) in chosen.chunks(lanes).zip(forces.chunks_mut(lanes)) {
            if chosen.len() == lanes {
                for (places, &vertex) in places.iter_mut().zip(chosen) {
                    *places = incidence.of(vertex);
                }
                self.force_side_by_side(&places[..lanes], &vertices, forces);
            } else {
                for (&vertex, vertex_force) in chosen.iter().zip(forces) {
                    self.force_one_by_one(incidence.of(vertex), &vertices, vertex_force);
                }
            }
        }
    }

    fn vertex_count(&self) -> usize {
        self.vertex_count
    }
}
