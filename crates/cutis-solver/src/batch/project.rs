//! The loops over a range of constraints: scalar for the reference, with SIMD lanes for threads.

use std::ops::Range;

use cutis_constraints::{Constraint, LaneTask, Lanes, Params, Scalar, SimdLevel};
use nalgebra::{Point3, Vector3};

use super::runs::{QUAD, ROW, RUNS};
use super::{Batch, ConstraintChunk, LaneAccess, MAX_LANES, Project, Store, TeamForces, VertexChunk};
use crate::colored::{SharedStore, SharedVertices};
use crate::teams::TeamConstraints;
use crate::{Step, Values, Vertex, VertexStore, project};

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
    fn project_in_lanes<L: Lanes<T>, S: LaneAccess<T>>(&self, chunk: ConstraintChunk<'_, T, S>) {
        let ConstraintChunk { range, mut vertices, step, multipliers } = chunk;
        let rule = match step {
            Step::Pbd => Step::Pbd,
            Step::Xpbd { inverse_h_squared } => Step::Xpbd { inverse_h_squared: L::splat(inverse_h_squared) },
        };
        let (start, keeps) = (range.start, !multipliers.is_empty());
        let mut first = start;
        while first < range.end {
            let (piece, part) = match S::READS_ROWS {
                true => self.runs.part(first..range.end),
                false => (1, range.clone()),
            };
            let whole = first..part.end - part.len() % L::LANES;
            let own = if keeps { &mut multipliers[first - start..] } else { &mut [][..] };
            match piece {
                ROW if keeps => self.project_rows::<L, S, true>(whole.clone(), &mut vertices, rule, own),
                ROW => self.project_rows::<L, S, false>(whole.clone(), &mut vertices, rule, own),
                QUAD => self.project_run::<L, S, QUAD>(whole.clone(), &mut vertices, rule, own),
                _ => self.project_run::<L, S, 1>(whole.clone(), &mut vertices, rule, own),
            }
            first = whole.end;
            let multipliers =
                if keeps { &mut multipliers[first - start..part.end - start] } else { &mut [][..] };
            let rest = first..part.end;
            let rest = ConstraintChunk { range: rest, vertices: &mut vertices, step, multipliers };
            self.project_scalar(rest);
            first = part.end;
        }
    }

    /// Projects constraints in pieces of one length, whose number is a multiple of the lanes. The
    /// first multipliers are theirs, if there are any.
    #[inline(always)]
    fn project_run<L: Lanes<T>, S: LaneAccess<T>, const PIECE: usize>(
        &self,
        range: Range<usize>,
        vertices: &mut S,
        rule: Step<L>,
        multipliers: &mut [T],
    ) {
        let tuples = self.indices[range.clone()].chunks_exact(L::LANES);
        let params = self.params[range.clone()].chunks_exact(L::LANES);
        let (same, each) = match self.stiffness.values() {
            Values::Uniform(value) => (L::splat(*value), &[][..]),
            Values::Each(values) => (L::splat(T::zero()), &values[range]),
        };
        for (n, (tuples, params)) in tuples.zip(params).enumerate() {
            let first = n * L::LANES;
            let stiffness = if each.is_empty() { same } else { L::from_slice(&each[first..]) };
            let multipliers = if multipliers.is_empty() { &mut [] } else { &mut multipliers[first..] };
            let group = Group { tuples, params, stiffness };
            group.project::<C, T, S, PIECE>(vertices, rule, multipliers);
        }
    }

    /// Projects long pieces of rows, or a part of one. The first multipliers are theirs, if there
    /// are any. This is the inner loop of a lattice: it has no bounds to check and few branches.
    #[inline(always)]
    fn project_rows<L: Lanes<T>, S: LaneAccess<T>, const KEEPS: bool>(
        &self,
        range: Range<usize>,
        vertices: &mut S,
        rule: Step<L>,
        multipliers: &mut [T],
    ) {
        if range.is_empty() {
            return;
        }
        let first = self.runs.rows_before(range.start);
        let rows = self.rows[first..].iter().zip(self.params[range.clone()].chunks(ROW));
        let same = [T::zero(); ROW];
        let (same, each) = match self.stiffness.values() {
            Values::Uniform(value) => (same.map(|_| *value), &[][..]),
            Values::Each(values) => (same, &values[range]),
        };
        let mut each = each.chunks(ROW);
        let mut multipliers = multipliers.chunks_mut(ROW);
        for (row, params) in rows {
            let stiffness = each.next().unwrap_or(&same);
            let multipliers = if KEEPS { multipliers.next().unwrap_or_default() } else { &mut [] };
            for place in (0..params.len()).step_by(L::LANES) {
                let tuples = &[row.map(|vertex| vertex + 2 * place as u32)];
                let params = &params[place..place + L::LANES];
                let stiffness = L::from_slice(&stiffness[place..]);
                let group = Group { tuples, params, stiffness };
                let multipliers = if KEEPS { &mut multipliers[place..] } else { &mut [] };
                group.project::<C, T, S, ROW>(vertices, rule, multipliers);
            }
        }
    }
}

/// As many constraints as there are lanes.
struct Group<'a, P, L, const N: usize> {
    /// The vertices of each constraint, or of the first one in a long piece.
    tuples: &'a [[u32; N]],
    params: &'a [P],
    stiffness: L,
}

/// Repeats a statement for each corner `$i` below `$n`, with a constant `$i` for the first four.
/// The numbers of a corner then stay in registers.
macro_rules! for_each_corner {
    ($i:ident, $n:expr, $body:block) => {
        for_each_corner!(once 0, $i, $n, $body);
        for_each_corner!(once 1, $i, $n, $body);
        for_each_corner!(once 2, $i, $n, $body);
        for_each_corner!(once 3, $i, $n, $body);
        for $i in 4..$n $body
    };
    (once $number:literal, $i:ident, $n:expr, $body:block) => {
        if $number < $n {
            let $i = $number;
            $body
        }
    };
}

impl<P, L, const N: usize> Group<'_, P, L, N> {
    /// Projects the constraints. The first multipliers are theirs, if there are any.
    #[inline(always)]
    fn project<C, T, S, const PIECE: usize>(&self, vertices: &mut S, rule: Step<L>, multipliers: &mut [T])
    where
        C: Constraint<N, Params<T> = P>,
        P: Params<T>,
        T: Scalar,
        L: Lanes<T>,
        S: LaneAccess<T>,
    {
        let Self { tuples, params, stiffness } = self;
        let mut x = [Point3::origin(); N];
        let mut w = [L::splat(T::zero()); N];
        for_each_corner!(i, N, {
            let [a, b, c, d] = vertices.read::<L, N, PIECE>(tuples, i);
            (x[i], w[i]) = (Point3::new(a, b, c), d);
        });
        let params = if P::LEN == 1 {
            Params::from_fn(|_| L::from_slice(P::flat(params)))
        } else {
            Params::from_fn(|j| L::from_lanes(|lane| params[lane].as_ref()[j]))
        };
        let keeps = !multipliers.is_empty();
        let multiplier = if keeps { L::from_slice(multipliers) } else { L::splat(T::zero()) };
        let projection = project::<C, N, L, _>(&x, &w, &params, rule, *stiffness, multiplier);
        if keeps {
            let sum: L = multiplier + projection.multiplier;
            sum.write_to(multipliers);
        }
        for_each_corner!(i, N, {
            let moved = x[i] + projection.corrections[i];
            vertices.write::<L, N, PIECE>(tuples, i, [moved.x, moved.y, moved.z, w[i]]);
        });
    }
}

/// The projection of a chunk, for any number of lanes.
struct ProjectTask<'a, B, T, S> {
    batch: &'a B,
    chunk: ConstraintChunk<'a, T, S>,
}

impl<C: Constraint<N>, const N: usize, T: Scalar, S: LaneAccess<T>> LaneTask<T>
    for ProjectTask<'_, Batch<C, N, T, C::Params<T>>, T, S>
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
    fn project(&self, chunk: ConstraintChunk<'_, T, VertexStore<'_, T>>) {
        let ConstraintChunk { range, vertices, step, multipliers } = chunk;
        match vertices {
            VertexStore::Vertices(mut vertices) => {
                self.project_scalar(ConstraintChunk { range, vertices: &mut vertices, step, multipliers });
            }
            VertexStore::Columns(mut vertices) => {
                self.project_scalar(ConstraintChunk { range, vertices: &mut vertices, step, multipliers });
            }
        }
    }

    fn project_shared(&self, level: SimdLevel, chunk: ConstraintChunk<'_, T, SharedStore<'_, T>>) {
        let ConstraintChunk { range, vertices, step, multipliers } = chunk;
        match vertices {
            SharedStore::Vertices(vertices) => {
                let chunk = ConstraintChunk { range, vertices, step, multipliers };
                T::in_lanes(level, ProjectTask { batch: self, chunk });
            }
            SharedStore::Columns(vertices) => {
                let chunk = ConstraintChunk { range, vertices, step, multipliers };
                T::in_lanes(level, ProjectTask { batch: self, chunk });
            }
        }
    }

    fn runs(&self, range: Range<usize>) -> [Range<usize>; RUNS] {
        self.runs.divide(range)
    }

    fn vertex_forces(&self, chunk: VertexChunk<'_, T, &[Vertex<T>]>) {
        for (&vertex, force) in chunk.indices.iter().zip(chunk.forces) {
            self.force_scalar(chunk.incidence.of(vertex), &chunk.vertices, force);
        }
    }

    fn add_forces(&self, vertices: &[Vertex<T>], forces: &mut [Vector3<T>]) {
        self.add_constraint_forces(vertices, forces);
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
