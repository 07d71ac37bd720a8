//! The loops over the constraints of single vertices, for vertex block descent.

use cutis_constraints::{Constraint, Lanes, Params, Scalar};
use nalgebra::{Point3, Vector3};

use super::{Batch, Load, MAX_LANES};
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
        let vector = |part: fn(&VertexForce<T>) -> &Vector3<T>| {
            Vector3::from_fn(|axis, _| {
                L::from_lanes(|lane| forces.get(lane).map_or(T::zero(), |force| part(force)[axis]))
            })
        };
        let mut sum = VertexForce {
            force: vector(|force| &force.force),
            diagonal: vector(|force| &force.diagonal),
            mixed: vector(|force| &force.mixed),
        };
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
        for (lane, force) in forces.iter_mut().enumerate() {
            *force = VertexForce {
                force: sum.force.map(|component| component.extract(lane)),
                diagonal: sum.diagonal.map(|component| component.extract(lane)),
                mixed: sum.mixed.map(|component| component.extract(lane)),
            };
        }
    }
}
