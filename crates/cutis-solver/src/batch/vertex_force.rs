//! How constraints act on single vertices: the loops over the constraints of a vertex, for vertex block descent.

use cutis_constraints::{Constraint, Params, Scalar};
use nalgebra::{Point3, Vector3};
use simba::simd::{SimdPartialOrd, SimdValue};

use super::{Batch, Load, MOST_LANES};
use crate::{Values, VertexForce};

impl<C: Constraint<N>, const N: usize, T: Scalar> Batch<C, N, T, C::Params<T>> {
    /// Adds to `vertex_force` what the constraints at `places` do to one vertex, in ascending order.
    #[inline(always)]
    pub(super) fn force_one_by_one<L: Load<T>>(
        &self,
        places: &[u32],
        load: &L,
        vertex_force: &mut VertexForce<T>,
    ) {
        let stiffness = self.stiffness.values();
        for &place in places {
            let (k, slot) = (place as usize / N, place as usize % N);
            let x = self.indices[k].map(|i| load.load(i).position());
            let eval = C::eval(&x, &self.params[k]);
            vertex_force.add(eval.c, &eval.grad[slot], stiffness.at(k), C::rest_size(&self.params[k]));
        }
    }

    /// The same for several vertices side by side, as long as each of them has constraints left, and the rest one by one.
    #[inline(always)]
    pub(super) fn force_side_by_side<L: Load<T>>(
        &self,
        places: &[&[u32]],
        load: &L,
        forces: &mut [VertexForce<T>],
    ) {
        let stiffness = self.stiffness.values();
        let common = places.iter().map(|places| places.len()).min().unwrap_or(0);
        let vector = |part: fn(&VertexForce<T>) -> &Vector3<T>, forces: &[VertexForce<T>]| {
            Vector3::from_fn(|axis, _| T::lanes(|lane| part(&forces[lane])[axis]))
        };
        let mut sum = VertexForce {
            force: vector(|vertex_force| &vertex_force.force, forces),
            diagonal: vector(|vertex_force| &vertex_force.diagonal, forces),
            mixed: vector(|vertex_force| &vertex_force.mixed, forces),
        };
        for n in 0..common {
            // Every lane is looked up once; lanes that there are not repeat the last one.
            let place: [usize; MOST_LANES] =
                std::array::from_fn(|lane| places[lane.min(places.len() - 1)][n] as usize);
            let constraint = place.map(|place| place / N);
            let corners = constraint.map(|k| self.indices[k].map(|i| load.load(i)));
            let x: [Point3<T::Lanes>; N] = std::array::from_fn(|i| {
                let column = |axis: usize| T::lanes(|lane| corners[lane][i].component(axis));
                Point3::new(column(0), column(1), column(2))
            });
            let numbers = constraint.map(|k| &self.params[k]);
            let params = Params::from_fn(|j| T::lanes(|lane| numbers[lane].as_ref()[j]));
            let eval = C::eval(&x, &params);
            let slot = T::lanes(|lane| T::constant((place[lane] % N) as f64));
            let mut gradient = eval.grad[0];
            for i in 1..N {
                let here = slot.simd_eq(T::Lanes::splat(T::constant(i as f64)));
                gradient = gradient.zip_map(&eval.grad[i], |other, this| this.select(here, other));
            }
            let compliance = match stiffness {
                Values::Uniform(value) => T::Lanes::splat(*value),
                Values::Each(values) => T::lanes(|lane| values[constraint[lane]]),
            };
            sum.add(eval.c, &gradient, compliance, C::rest_size(&params));
        }
        for (lane, (vertex_force, places)) in forces.iter_mut().zip(places).enumerate() {
            *vertex_force = VertexForce {
                force: sum.force.map(|component| component.extract(lane)),
                diagonal: sum.diagonal.map(|component| component.extract(lane)),
                mixed: sum.mixed.map(|component| component.extract(lane)),
            };
            self.force_one_by_one(&places[common..], load, vertex_force);
        }
    }
}
