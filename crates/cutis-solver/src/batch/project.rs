//! The loops over a range of constraints: scalar for the reference, with SIMD lanes for threads.

use cutis_constraints::{Constraint, LaneTask, Lanes, Params, Scalar, SimdLevel};
use nalgebra::Point3;

use super::{Batch, ConstraintChunk, MAX_LANES, Project, Store, TeamForces, VertexChunk};
use crate::colored::SharedVertices;
use crate::teams::TeamConstraints;
use crate::{Step, Values, Vertex, project};

impl<C: Constraint<N>, const N: usize, T: Scalar> Batch<C, N, T, C::Params<T>> {
    /// Projects one constraint after the other.
    fn project_scalar<S: Store<T>>(&self, chunk: ConstraintChunk<'_, T, &mut S>) {
        let ConstraintChunk { range, vertices: store, step, multipliers } = chunk;
        let start = range.start;
        let stiffness = self.stiffness.values();
        for (k, (tuple, params)) in self.indices[range.clone()].iter().zip(&self.params[range]).enumerate() {
            let vertices = tuple.map(|i| store.load(i));
            let x = vertices.map(|v| v.position());
            let w = vertices.map(|v| v.inverse_mass());
            let multiplier = multipliers.get(k).copied().unwrap_or_else(T::zero);
            let projection = project::<C, N, T, _>(&x, &w, params, step, stiffness.at(start + k), multiplier);
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
    #[inline(always)]
    fn project_in_lanes<L: Lanes<T>, S: Store<T>>(&self, chunk: ConstraintChunk<'_, T, S>) {
        let ConstraintChunk { range, vertices: mut store, step, multipliers } = chunk;
        let lanes = L::LANES;
        let stiffness = self.stiffness.values();
        let rule = match step {
            Step::Pbd => Step::Pbd,
            Step::Xpbd { inverse_h_squared } => Step::Xpbd { inverse_h_squared: L::splat(inverse_h_squared) },
        };
        let groups = range.len() / lanes;
        let (mut rest, keeps) = (range.clone(), !multipliers.is_empty());
        for group in 0..groups {
            let first = range.start + group * lanes;
            let tuples = &self.indices[first..first + lanes];
            let params = &self.params[first..first + lanes];
            let mut x = [Point3::origin(); N];
            let mut w = [L::splat(T::zero()); N];
            for i in 0..N {
                let [a, b, c, d] = L::columns(|lane| store.load(tuples[lane][i]).components());
                (x[i], w[i]) = (Point3::new(a, b, c), d);
            }
            let params = Params::from_fn(|j| L::from_lanes(|lane| params[lane].as_ref()[j]));
            let stiffness = match stiffness {
                Values::Uniform(value) => L::splat(*value),
                Values::Each(values) => {
                    let values = &values[first..first + lanes];
                    L::from_lanes(|lane| values[lane])
                }
            };
            let offset = group * lanes;
            let multiplier = if keeps {
                let multipliers = &multipliers[offset..offset + lanes];
                L::from_lanes(|lane| multipliers[lane])
            } else {
                L::splat(T::zero())
            };
            let projection = project::<C, N, L, _>(&x, &w, &params, rule, stiffness, multiplier);
            if keeps {
                let sum: L = multiplier + projection.multiplier;
                for lane in 0..lanes {
                    multipliers[offset + lane] = sum.extract(lane);
                }
            }
            for i in 0..N {
                let moved = x[i] + projection.corrections[i];
                L::rows([moved.x, moved.y, moved.z, w[i]], |lane, components| {
                    store.store(tuples[lane][i], Vertex::from_components(components));
                });
            }
            rest.start = first + lanes;
        }
        let multipliers = if keeps { &mut multipliers[groups * lanes..] } else { multipliers };
        let rest = ConstraintChunk { range: rest, vertices: &mut store, step, multipliers };
        self.project_scalar(rest);
    }
}

/// The projection of a chunk, for any number of lanes.
struct ProjectTask<'a, 'b, B, T: Scalar> {
    batch: &'a B,
    chunk: ConstraintChunk<'a, T, SharedVertices<'b, T>>,
}

impl<C: Constraint<N>, const N: usize, T: Scalar> LaneTask<T>
    for ProjectTask<'_, '_, Batch<C, N, T, C::Params<T>>, T>
{
    #[inline(always)]
    fn run<L: Lanes<T>>(self) {
        self.batch.project_in_lanes::<L, _>(self.chunk);
    }
}

/// The forces on the vertices of a chunk, for any number of lanes.
struct ForceTask<'a, 'b, B, T: Scalar> {
    batch: &'a B,
    chunk: VertexChunk<'a, T, SharedVertices<'b, T>>,
}

impl<C: Constraint<N>, const N: usize, T: Scalar> LaneTask<T>
    for ForceTask<'_, '_, Batch<C, N, T, C::Params<T>>, T>
{
    #[inline(always)]
    fn run<L: Lanes<T>>(self) {
        let VertexChunk { incidence, indices, vertices, forces } = self.chunk;
        for (indices, forces) in indices.chunks(L::LANES).zip(forces.chunks_mut(L::LANES)) {
            let mut entries: [&[u32]; MAX_LANES] = [&[]; MAX_LANES];
            for (entries, &index) in entries.iter_mut().zip(indices) {
                *entries = incidence.of(index);
            }
            self.batch.forces_in_lanes::<L, _>(&entries[..indices.len()], &vertices, forces);
        }
    }
}

/// The forces on the vertices of a team, for any number of lanes.
struct TeamTask<'a, B, T> {
    batch: &'a B,
    team: &'a TeamConstraints<'a, T>,
    forces: &'a mut TeamForces<T>,
}

impl<C: Constraint<N>, const N: usize, T: Scalar> LaneTask<T>
    for TeamTask<'_, Batch<C, N, T, C::Params<T>>, T>
{
    #[inline(always)]
    fn run<L: Lanes<T>>(self) {
        self.batch.forces_of_team::<L>(self.team, self.forces);
    }
}

impl<C: Constraint<N>, const N: usize, T: Scalar> Project<T> for Batch<C, N, T, C::Params<T>> {
    fn project(&self, chunk: ConstraintChunk<'_, T, &mut [Vertex<T>]>) {
        let ConstraintChunk { range, mut vertices, step, multipliers } = chunk;
        let chunk = ConstraintChunk { range, vertices: &mut vertices, step, multipliers };
        self.project_scalar(chunk);
    }

    fn project_shared(&self, level: SimdLevel, chunk: ConstraintChunk<'_, T, SharedVertices<'_, T>>) {
        T::in_lanes(level, ProjectTask { batch: self, chunk });
    }

    fn vertex_forces(&self, chunk: VertexChunk<'_, T, &[Vertex<T>]>) {
        for (&vertex, force) in chunk.indices.iter().zip(chunk.forces) {
            self.force_scalar(chunk.incidence.of(vertex), &chunk.vertices, force);
        }
    }

    fn vertex_forces_shared(&self, level: SimdLevel, chunk: VertexChunk<'_, T, SharedVertices<'_, T>>) {
        T::in_lanes(level, ForceTask { batch: self, chunk });
    }

    fn team_forces(&self, level: SimdLevel, team: &TeamConstraints<'_, T>, forces: &mut TeamForces<T>) {
        T::in_lanes(level, TeamTask { batch: self, team, forces });
    }

    fn vertex_count(&self) -> usize {
        self.vertex_count
    }
}
