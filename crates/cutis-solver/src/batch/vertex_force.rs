//! The loops over the constraints of single vertices, for vertex block descent.

use cutis_constraints::{Constraint, Lanes, Params, Scalar};
use nalgebra::{Point3, Vector3};

use super::{Batch, Load, MAX_LANES};
use crate::teams::{TEAM, TeamConstraints};
use crate::{Values, Vertex, VertexForce};

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

    /// Adds the force of each constraint to its vertices. The places of a vertex ascend with the
    /// constraints, so that every sum has the bits of [`force_scalar`](Self::force_scalar).
    pub(super) fn add_constraint_forces(&self, vertices: &[Vertex<T>], forces: &mut [Vector3<T>]) {
        let compliances = self.stiffness.values();
        for (k, (tuple, params)) in self.indices.iter().zip(&self.params).enumerate() {
            let eval = C::eval(&tuple.map(|i| vertices[i as usize].position()), params);
            let stiffness = T::one() / compliances.at(k);
            for (&vertex, gradient) in tuple.iter().zip(&eval.grad) {
                forces[vertex as usize] -= gradient * stiffness * eval.c;
            }
        }
    }

    /// Adds the forces on the vertices of a team.
    #[inline(always)]
    pub(super) fn forces_of_team<L: Lanes<T>>(
        &self,
        team: &TeamConstraints<'_, T>,
        forces: &mut TeamForces<T>,
    ) {
        if team.entries.is_empty() {
            return;
        }
        for first in (0..team.count).step_by(L::LANES) {
            let mut sum = forces.lanes::<L>(first);
            self.add_team(team, first, &mut sum);
            forces.set_lanes(first, &sum);
        }
    }

    /// Adds the forces on as many vertices of a team as there are lanes, from vertex `first` on.
    #[inline(always)]
    fn add_team<L: Lanes<T>>(&self, team: &TeamConstraints<'_, T>, first: usize, sum: &mut VertexForce<L>) {
        let same = match self.stiffness.values() {
            Values::Uniform(compliance) => Some(L::splat(T::one() / *compliance)),
            Values::Each(_) => None,
        };
        let params_len = <C::Params<T> as Params<T>>::LEN;
        let per_entry = params_len + usize::from(same.is_none());
        let entries = team.entries.chunks_exact(N + 1);
        for (entry, numbers) in entries.zip(team.numbers.chunks_exact(per_entry)) {
            let mut x = [Point3::origin(); N];
            for i in 0..N {
                let [a, b, c] = &team.neighborhood[entry[1 + i] as usize];
                x[i] = Point3::new(load(a, first), load(b, first), load(c, first));
            }
            let params = Params::from_fn(|j| load(&numbers[j], first));
            let stiffness = match same {
                Some(stiffness) => stiffness,
                None => load(&numbers[params_len], first),
            };
            let eval = C::eval(&x, &params);
            sum.add_stiff(eval.c, &eval.grad[entry[0] as usize], stiffness, C::rest_size(&params));
        }
    }

    /// Adds the forces on several vertices, one per SIMD lane, at most as many as there are lanes.
    ///
    /// A lane whose vertex has fewer constraints than others repeats the constraint of another
    /// lane, and keeps its sum. So every lane has the bits of [`force_scalar`](Self::force_scalar).
    #[inline(always)]
    pub(super) fn forces_in_lanes<L: Lanes<T>, V: Load<T>>(
        &self,
        entries: &[&[u32]],
        load: &V,
        forces: &mut [VertexForce<T>],
    ) {
        let stiffness = self.stiffness.values();
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
        let mut sum = gather_forces::<L, T>(forces);
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
        scatter_forces(&sum, forces);
    }
}

/// As many numbers as there are lanes, from place `first` on.
#[inline(always)]
fn load<L: Lanes<T>, T: Scalar>(numbers: &[T; TEAM], first: usize) -> L {
    L::from_slice(&numbers[first..first + L::LANES])
}

/// Forces on the vertices of a team, number by number.
pub struct TeamForces<T>([[T; TEAM]; 9]);

impl<T: Scalar> TeamForces<T> {
    /// No force.
    pub(crate) fn none() -> Self {
        Self([[T::zero(); TEAM]; 9])
    }

    /// The forces on as many vertices as there are lanes.
    #[inline(always)]
    pub(crate) fn lanes<L: Lanes<T>>(&self, first: usize) -> VertexForce<L> {
        let [a, b, c, d, e, f, g, h, i] = &self.0;
        VertexForce {
            force: Vector3::new(load(a, first), load(b, first), load(c, first)),
            diagonal: Vector3::new(load(d, first), load(e, first), load(f, first)),
            mixed: Vector3::new(load(g, first), load(h, first), load(i, first)),
        }
    }

    #[inline(always)]
    fn set_lanes<L: Lanes<T>>(&mut self, first: usize, sum: &VertexForce<L>) {
        let parts = [&sum.force, &sum.diagonal, &sum.mixed];
        for (row, numbers) in self.0.iter_mut().enumerate() {
            parts[row / 3][row % 3].write_to(&mut numbers[first..first + L::LANES]);
        }
    }
}

/// Some forces, one per lane. Excess lanes repeat the last one.
#[inline(always)]
fn gather_forces<L: Lanes<T>, T: Scalar>(forces: &[VertexForce<T>]) -> VertexForce<L> {
    let last = forces.len() - 1;
    let vector = |part: fn(&VertexForce<T>) -> &Vector3<T>| {
        let component = |axis: usize| L::from_lanes(|lane| part(&forces[lane.min(last)])[axis]);
        Vector3::new(component(0), component(1), component(2))
    };
    VertexForce {
        force: vector(|force| &force.force),
        diagonal: vector(|force| &force.diagonal),
        mixed: vector(|force| &force.mixed),
    }
}

/// Writes one lane to each force.
#[inline(always)]
fn scatter_forces<L: Lanes<T>, T: Scalar>(sum: &VertexForce<L>, forces: &mut [VertexForce<T>]) {
    for (lane, force) in forces.iter_mut().enumerate() {
        let of_lane = |v: &Vector3<L>| Vector3::new(v.x.extract(lane), v.y.extract(lane), v.z.extract(lane));
        *force = VertexForce {
            force: of_lane(&sum.force),
            diagonal: of_lane(&sum.diagonal),
            mixed: of_lane(&sum.mixed),
        };
    }
}
