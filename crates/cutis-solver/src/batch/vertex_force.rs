//! The loops over the constraints of single vertices, for vertex block descent.

use cutis_coloring::Incidence;
use cutis_constraints::{Constraint, Lanes, Params, Scalar};
use nalgebra::{Point3, Vector3};

use super::{Batch, Load, MAX_LANES};
use crate::runs::RUN;
use crate::{Values, VertexForce};

impl<C: Constraint<N>, const N: usize, T: Scalar> Batch<C, N, T, C::Params<T>> {
    /// Adds the forces of constraints on one vertex, in ascending order. Each entry of `entries`
    /// is the index of a constraint times `N`, plus the position of the vertex in its tuple.
    #[inline(always)]
    pub(super) fn force_scalar<L: Load<T>>(&self, entries: &[u32], load: &L, force: &mut VertexForce<T>) {
        let stiffness = self.stiffness.values();
        for &entry in entries {
            let (k, corner) = (entry as usize / N, entry as usize % N);
            let x = self.indices[k].map(|i| load.load(i).position());
            let eval = C::eval(&x, &self.params[k]);
            force.add(eval.c, &eval.grad[corner], stiffness.at(k), C::rest_size(&self.params[k]));
        }
    }

    /// Adds the forces on the vertices of runs of one pattern, as many as fill the lanes.
    ///
    /// `runs` are patterns and positions of first vertices in `indices`. The constraints of the
    /// vertices of a run have one distance. If it is 1, they are read as one block.
    #[inline(always)]
    pub(super) fn forces_of_runs<L: Lanes<T>, V: Load<T>>(
        &self,
        runs: &[(u8, u16)],
        incidence: &Incidence,
        indices: &[u32],
        load: &V,
        forces: &mut [VertexForce<T>],
    ) {
        let mut entries: [&[u32]; MAX_LANES / RUN] = [&[]; MAX_LANES / RUN];
        let mut starts = [0; MAX_LANES / RUN];
        for ((entries, start), &(_, at)) in entries.iter_mut().zip(&mut starts).zip(runs) {
            *start = at as usize;
            *entries = incidence.of(indices[*start]);
        }
        let next = incidence.of(indices[starts[0] + 1]);
        let count = entries[0].len();
        if count == 0 {
            return;
        }
        let stiffness = self.stiffness.values();
        let place = |lane: usize| starts[lane / RUN] + lane % RUN;
        let mut sum = gather_forces::<L, T>(forces, place);
        for n in 0..count {
            // With fewer lanes, the excess elements repeat the first run.
            let mut first = [entries[0][n] as usize / N; MAX_LANES / RUN];
            for (first, entries) in first.iter_mut().zip(&entries[..runs.len()]) {
                *first = entries[n] as usize / N;
            }
            let corner = entries[0][n] as usize % N;
            let step = (next[n] - entries[0][n]) as usize / N;
            let last = (RUN - 1) * step + 1;
            let tuples = first.map(|k| &self.indices[k..k + last]);
            let mut x = [Point3::origin(); N];
            for i in 0..N {
                let row = |lane: usize| load.load(tuples[lane / RUN][lane % RUN * step][i]).components();
                let [a, b, c, _] = L::columns(row);
                x[i] = Point3::new(a, b, c);
            }
            let scalars = first.map(|k| &self.params[k..k + last]);
            let params = Params::from_fn(|j| quads(step, &scalars, |params| params.as_ref()[j]));
            let compliance = match stiffness {
                Values::Uniform(value) => L::splat(*value),
                Values::Each(values) => quads(step, &first.map(|k| &values[k..k + last]), |value| *value),
            };
            let eval = C::eval(&x, &params);
            sum.add(eval.c, &eval.grad[corner], compliance, C::rest_size(&params));
        }
        scatter_forces(&sum, forces, L::LANES, place);
    }

    /// Adds the forces on several vertices, one per SIMD lane, at most as many as there are lanes.
    /// `places` are their positions in `forces`.
    ///
    /// A lane whose vertex has fewer constraints than others repeats the constraint of another
    /// lane, and keeps its sum. So every lane has the bits of [`force_scalar`](Self::force_scalar).
    #[inline(always)]
    pub(super) fn forces_in_lanes<L: Lanes<T>, V: Load<T>>(
        &self,
        entries: &[&[u32]],
        places: &[u16],
        load: &V,
        forces: &mut [VertexForce<T>],
    ) {
        let stiffness = self.stiffness.values();
        let place = |lane: usize| places[lane.min(places.len() - 1)] as usize;
        let (mut common, mut longest) = (usize::MAX, 0);
        for (lane, own) in entries.iter().enumerate() {
            common = common.min(own.len());
            longest = if own.len() > entries[longest].len() { lane } else { longest };
        }
        let most = entries[longest].len();
        if most == 0 {
            return;
        }
        let common = if entries.len() == L::LANES { common } else { 0 };
        let mut sum = gather_forces::<L, T>(forces, place);
        let count =
            L::from_lanes(|lane| T::constant(entries.get(lane).map_or(0.0, |entries| entries.len() as f64)));
        for n in 0..most {
            let mut constraint = [0; MAX_LANES];
            let mut corner = [0; MAX_LANES];
            for lane in 0..L::LANES {
                let own = entries.get(lane).and_then(|own| own.get(n)).unwrap_or(&entries[longest][n]);
                (constraint[lane], corner[lane]) = (*own as usize / N, *own as usize % N);
            }
            let mut tuples = [[0; N]; MAX_LANES];
            let mut scalars = [C::Params::<T>::from_fn(|_| T::zero()); MAX_LANES];
            for lane in 0..L::LANES {
                tuples[lane] = self.indices[constraint[lane]];
                scalars[lane] = self.params[constraint[lane]];
            }
            let mut x = [Point3::origin(); N];
            for i in 0..N {
                let [a, b, c, _] = L::columns(|lane| load.load(tuples[lane][i]).components());
                x[i] = Point3::new(a, b, c);
            }
            let params = Params::from_fn(|j| L::from_lanes(|lane| scalars[lane].as_ref()[j]));
            let eval = C::eval(&x, &params);
            let corner = L::from_lanes(|lane| T::constant(corner[lane] as f64));
            let mut gradient = eval.grad[0];
            for i in 1..N {
                let matches = corner.simd_eq(L::splat(T::constant(i as f64)));
                gradient = gradient.zip_map(&eval.grad[i], |other, this| this.select(matches, other));
            }
            let compliance = match stiffness {
                Values::Uniform(value) => L::splat(*value),
                Values::Each(values) => L::from_lanes(|lane| values[constraint[lane]]),
            };
            let before = sum;
            sum.add(eval.c, &gradient, compliance, C::rest_size(&params));
            if n >= common {
                let own = count.simd_gt(L::splat(T::constant(n as f64)));
                let keep =
                    |new: Vector3<L>, old: Vector3<L>| new.zip_map(&old, |new, old| new.select(own, old));
                sum.force = keep(sum.force, before.force);
                sum.diagonal = keep(sum.diagonal, before.diagonal);
                sum.mixed = keep(sum.mixed, before.mixed);
            }
        }
        scatter_forces(&sum, forces, places.len(), place);
    }
}

/// A number of each constraint of some runs, whose constraints have the distance `step`.
#[inline(always)]
fn quads<L: Lanes<T>, T: Scalar, V>(
    step: usize,
    runs: &[&[V]; MAX_LANES / RUN],
    number: impl Fn(&V) -> T,
) -> L {
    if step == 1 {
        // As one block, which the compiler can load with one instruction.
        L::from_quads(|run| std::array::from_fn(|n| number(&runs[run][..RUN][n])))
    } else {
        L::from_quads(|run| std::array::from_fn(|n| number(&runs[run][n * step])))
    }
}

/// The forces at some places, one place per lane.
#[inline(always)]
fn gather_forces<L: Lanes<T>, T: Scalar>(
    forces: &[VertexForce<T>],
    place: impl Fn(usize) -> usize,
) -> VertexForce<L> {
    let vector = |part: fn(&VertexForce<T>) -> &Vector3<T>| {
        let component = |axis: usize| L::from_lanes(|lane| part(&forces[place(lane)])[axis]);
        Vector3::new(component(0), component(1), component(2))
    };
    VertexForce {
        force: vector(|force| &force.force),
        diagonal: vector(|force| &force.diagonal),
        mixed: vector(|force| &force.mixed),
    }
}

/// Writes the first `count` lanes to their places.
#[inline(always)]
fn scatter_forces<L: Lanes<T>, T: Scalar>(
    sum: &VertexForce<L>,
    forces: &mut [VertexForce<T>],
    count: usize,
    place: impl Fn(usize) -> usize,
) {
    for lane in 0..count {
        let of_lane = |v: &Vector3<L>| Vector3::new(v.x.extract(lane), v.y.extract(lane), v.z.extract(lane));
        forces[place(lane)] = VertexForce {
            force: of_lane(&sum.force),
            diagonal: of_lane(&sum.diagonal),
            mixed: of_lane(&sum.mixed),
        };
    }
}
