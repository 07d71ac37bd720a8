//! The loops over the constraints of single vertices, for vertex block descent.

use cutis_constraints::{Constraint, Params, Scalar};
use nalgebra::{Point3, Vector3};
use simba::simd::{SimdPartialOrd, SimdValue};

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

    /// Adds the forces on several vertices, one per SIMD lane. The lanes process as many
    /// constraints as the vertex with the fewest constraints has. Scalar code adds the remaining
    /// ones.
    #[inline(always)]
    pub(super) fn forces_simd<L: Load<T>>(
        &self,
        entries: &[&[u32]],
        load: &L,
        forces: &mut [VertexForce<T>],
    ) {
        let stiffness = self.stiffness.values();
        let common = entries.iter().map(|entries| entries.len()).min().unwrap_or(0);
        let vector = |part: fn(&VertexForce<T>) -> &Vector3<T>, forces: &[VertexForce<T>]| {
            Vector3::from_fn(|axis, _| T::lanes(|lane| part(&forces[lane])[axis]))
        };
        let mut sum = VertexForce {
            force: vector(|force| &force.force, forces),
            diagonal: vector(|force| &force.diagonal, forces),
            mixed: vector(|force| &force.mixed, forces),
        };
        for n in 0..common {
            // The array is longer than the number of SIMD lanes of some number types. Its excess
            // elements repeat the last entry.
            let entry: [usize; MAX_LANES] =
                std::array::from_fn(|lane| entries[lane.min(entries.len() - 1)][n] as usize);
            let constraint = entry.map(|entry| entry / N);
            let vertices = constraint.map(|k| self.indices[k].map(|i| load.load(i)));
            let x: [Point3<T::Lanes>; N] = std::array::from_fn(|i| {
                let column = |axis: usize| T::lanes(|lane| vertices[lane][i].component(axis));
                Point3::new(column(0), column(1), column(2))
            });
            let scalars = constraint.map(|k| &self.params[k]);
            let params = Params::from_fn(|j| T::lanes(|lane| scalars[lane].as_ref()[j]));
            let eval = C::eval(&x, &params);
            let corner = T::lanes(|lane| T::constant((entry[lane] % N) as f64));
            let mut gradient = eval.grad[0];
            for i in 1..N {
                let matches = corner.simd_eq(T::Lanes::splat(T::constant(i as f64)));
                gradient = gradient.zip_map(&eval.grad[i], |other, this| this.select(matches, other));
            }
            let compliance = match stiffness {
                Values::Uniform(value) => T::Lanes::splat(*value),
                Values::Each(values) => T::lanes(|lane| values[constraint[lane]]),
            };
            sum.add(eval.c, &gradient, compliance, C::rest_size(&params));
        }
        for (lane, (force, entries)) in forces.iter_mut().zip(entries).enumerate() {
            *force = VertexForce {
                force: sum.force.map(|component| component.extract(lane)),
                diagonal: sum.diagonal.map(|component| component.extract(lane)),
                mixed: sum.mixed.map(|component| component.extract(lane)),
            };
            self.force_scalar(&entries[common..], load, force);
        }
    }
}
