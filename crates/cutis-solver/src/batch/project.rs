//! The loops over a range of constraints: scalar for the reference, with SIMD lanes for threads.

use cutis_constraints::{Constraint, Params, Scalar};
use nalgebra::Point3;
use simba::simd::SimdValue;

use super::{Batch, ConstraintChunk, MAX_LANES, Project, Store, VertexChunk};
use crate::colored::SharedVertices;
use crate::{Pbd, Rule, Step, Values, Vertex, Xpbd, project};

impl<C: Constraint<N>, const N: usize, T: Scalar> Batch<C, N, T, C::Params<T>> {
    /// Projects one constraint after the other.
    fn project_scalar<S: Store<T>, R: Rule<T>>(&self, chunk: ConstraintChunk<'_, T, &mut S>, rule: R) {
        let ConstraintChunk { range, vertices: store, multipliers, .. } = chunk;
        let start = range.start;
        let stiffness = self.stiffness.values();
        for (k, (tuple, params)) in self.indices[range.clone()].iter().zip(&self.params[range]).enumerate() {
            let vertices = tuple.map(|i| store.load(i));
            let x = vertices.map(|v| v.position());
            let w = vertices.map(|v| v.inverse_mass());
            let multiplier = multipliers.get(k).copied().unwrap_or_else(T::zero);
            let projection = project::<C, N, T, R>(&x, &w, params, rule, stiffness.at(start + k), multiplier);
            if let Some(multiplier) = multipliers.get_mut(k) {
                *multiplier += projection.multiplier;
            }
            for i in 0..N {
                store.store(tuple[i], Vertex::new(x[i] + projection.corrections[i], w[i]));
            }
        }
    }

    /// Projects constraints of one color in SIMD lanes, and the remainder with scalars. The result
    /// has the same bits as that of the scalar loop, because the constraints share no vertex and
    /// each lane executes the scalar operations.
    fn project_simd<S: Store<T>, R: Rule<T>, L: Rule<T::Lanes>>(
        &self,
        chunk: ConstraintChunk<'_, T, S>,
        rule: R,
        lane_rule: L,
    ) {
        let ConstraintChunk { range, vertices: mut store, step, multipliers } = chunk;
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
            let projection = project::<C, N, T::Lanes, L>(&x, &w, &params, lane_rule, stiffness, multiplier);
            if keeps {
                let sum: T::Lanes = multiplier + projection.multiplier;
                for lane in 0..lanes {
                    multipliers[offset + lane] = sum.extract(lane);
                }
            }
            for i in 0..N {
                let moved = x[i] + projection.corrections[i];
                for lane in 0..lanes {
                    let position = moved.map(|component| component.extract(lane));
                    store.store(tuples[lane][i], Vertex::new(position, w[i].extract(lane)));
                }
            }
            rest.start = first + lanes;
        }
        let multipliers = if keeps { &mut multipliers[groups * lanes..] } else { multipliers };
        let rest = ConstraintChunk { range: rest, vertices: &mut store, step, multipliers };
        self.project_scalar(rest, rule);
    }
}

impl<C: Constraint<N>, const N: usize, T: Scalar> Project<T> for Batch<C, N, T, C::Params<T>> {
    fn project(&self, chunk: ConstraintChunk<'_, T, &mut [Vertex<T>]>) {
        let ConstraintChunk { range, mut vertices, step, multipliers } = chunk;
        let chunk = ConstraintChunk { range, vertices: &mut vertices, step, multipliers };
        match step {
            Step::Pbd => self.project_scalar(chunk, Pbd),
            Step::Xpbd { inverse_h_squared } => self.project_scalar(chunk, Xpbd { inverse_h_squared }),
        }
    }

    fn project_shared(&self, chunk: ConstraintChunk<'_, T, SharedVertices<'_, T>>) {
        match chunk.step {
            Step::Pbd => self.project_simd(chunk, Pbd, Pbd),
            Step::Xpbd { inverse_h_squared } => {
                let lane_rule = Xpbd { inverse_h_squared: T::Lanes::splat(inverse_h_squared) };
                self.project_simd(chunk, Xpbd { inverse_h_squared }, lane_rule);
            }
        }
    }

    fn vertex_forces(&self, chunk: VertexChunk<'_, T, &[Vertex<T>]>) {
        for (&vertex, force) in chunk.indices.iter().zip(chunk.forces) {
            self.force_scalar(chunk.incidence.of(vertex), &chunk.vertices, force);
        }
    }

    fn vertex_forces_shared(&self, chunk: VertexChunk<'_, T, SharedVertices<'_, T>>) {
        let VertexChunk { incidence, indices, vertices, forces } = chunk;
        let lanes = T::Lanes::LANES;
        let mut entries: [&[u32]; MAX_LANES] = [&[]; MAX_LANES];
        for (indices, forces) in indices.chunks(lanes).zip(forces.chunks_mut(lanes)) {
            if indices.len() == lanes {
                for (entries, &vertex) in entries.iter_mut().zip(indices) {
                    *entries = incidence.of(vertex);
                }
                self.forces_simd(&entries[..lanes], &vertices, forces);
            } else {
                for (&vertex, force) in indices.iter().zip(forces) {
                    self.force_scalar(incidence.of(vertex), &vertices, force);
                }
            }
        }
    }

    fn vertex_count(&self) -> usize {
        self.vertex_count
    }
}
