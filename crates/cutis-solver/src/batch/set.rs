//! The arrays of one kind of constraint, and measurements over its constraints.

use std::marker::PhantomData;
use std::ops::Range;
use std::sync::Arc;

use cutis_constraints::{Constraint, Params, Scalar};
use nalgebra::{Point3, Vector3};

use super::Batch;
use crate::{ConstraintSet, Kind, Residual, Stiffness, Values, Vertex};

impl<C: Constraint<N>, const N: usize, T: Scalar> ConstraintSet<T> for Batch<C, N, T, C::Params<T>> {
    fn name(&self) -> &'static str {
        C::NAME
    }

    fn arity(&self) -> usize {
        N
    }

    fn offsets(&self) -> &[u32] {
        &self.offsets
    }

    fn tiles(&self) -> usize {
        self.tiles.count
    }

    fn part(&self, color: usize, tile: usize) -> Range<usize> {
        if color >= self.colors() || tile >= self.tiles.count {
            return 0..0;
        }
        if self.tiles.count == 1 {
            return self.range(color);
        }
        let first = color * self.tiles.count + tile;
        self.tiles.offsets[first] as usize..self.tiles.offsets[first + 1] as usize
    }

    fn constraints_in_rows(&self) -> usize {
        self.runs.constraints_in_rows(self.indices.len())
    }

    fn indices(&self) -> &[u32] {
        self.indices.as_flattened()
    }

    fn param_count(&self) -> usize {
        <C::Params<T> as Params<T>>::LEN
    }

    fn params(&self) -> &[T] {
        Params::flat(&self.params)
    }

    fn rest_size(&self, k: usize) -> T {
        C::rest_size(&self.params[k])
    }

    fn wgsl(&self) -> &'static str {
        C::WGSL
    }

    fn stiffness(&self) -> &Stiffness<T> {
        &self.stiffness
    }

    fn residual(&self, vertices: &[Vertex<T>]) -> Residual {
        let ratios = (0..self.indices.len()).filter_map(|k| {
            let rest_size = C::rest_size(&self.params[k]).to_f64();
            let c = C::eval(&self.positions(k, vertices), &self.params[k]).c.to_f64();
            (rest_size != 0.0).then(|| c / rest_size)
        });
        Residual::of(C::NAME, ratios)
    }

    fn elastic_energy(&self, vertices: &[Vertex<T>]) -> Option<f64> {
        let Stiffness::Compliance(compliance) = &self.stiffness else { return None };
        let energy = |k: usize| {
            let c = C::eval(&self.positions(k, vertices), &self.params[k]).c.to_f64();
            let compliance = compliance.at(k).to_f64();
            if compliance > 0.0 { 0.5 * c * c / compliance } else { 0.0 }
        };
        Some((0..self.indices.len()).map(energy).sum())
    }

    fn collapsed(&self, vertices: &[Vertex<T>], tolerance: f64) -> Option<(usize, f64)> {
        (0..self.indices.len()).find_map(|k| {
            let eval = C::eval(&self.positions(k, vertices), &self.params[k]);
            let ratio = eval.c.to_f64() / C::rest_size(&self.params[k]).to_f64();
            let free = |&i: &u32| vertices[i as usize].inverse_mass() > T::zero();
            let cannot_act = self.indices[k].iter().any(free) && eval.grad == [Vector3::zeros(); N];
            (ratio.is_finite() && ratio.abs() > tolerance && cannot_act).then_some((k, ratio))
        })
    }

    fn evaluate(&self, k: usize, x: &[Point3<f64>], grad: &mut [Vector3<f64>]) -> f64 {
        let eval = self.evaluated(k, x.as_array().expect("one position per vertex"));
        grad.copy_from_slice(&eval.grad);
        eval.c
    }

    fn evaluate_all(&self, constraints: &[u32], x: &[Point3<f64>], c: &mut [f64], grad: &mut [Vector3<f64>]) {
        let count = constraints.len();
        assert_eq!([x.len(), c.len(), grad.len()], [N * count, count, N * count], "the lengths do not fit");
        let of_constraints = constraints.iter().zip(x.as_chunks().0);
        let to = c.iter_mut().zip(grad.as_chunks_mut().0);
        for ((&k, x), (c, grad)) in of_constraints.zip(to) {
            let eval = self.evaluated(k as usize, x);
            (*c, *grad) = (eval.c, eval.grad);
        }
    }

    fn to_f64(&self) -> Kind<f64> {
        let to_f64 =
            |params: &C::Params<T>| <C::Params<f64> as Params<f64>>::from_fn(|j| params.as_ref()[j].to_f64());
        Arc::new(Batch::<C, N, f64, C::Params<f64>> {
            vertex_count: self.vertex_count,
            offsets: self.offsets.clone(),
            tiles: self.tiles.clone(),
            runs: self.runs.clone(),
            rows: self.rows.clone(),
            indices: self.indices.clone(),
            params: self.params.iter().map(to_f64).collect(),
            stiffness: self.stiffness.to_f64(),
            kind: PhantomData,
        })
    }

    fn bytes(&self) -> usize {
        let stiffness = match self.stiffness.values() {
            Values::Uniform(_) => 0,
            Values::Each(values) => size_of_val(values.as_slice()),
        };
        size_of_val(self.offsets.as_slice())
            + size_of_val(self.tiles.offsets.as_slice())
            + self.runs.bytes()
            + size_of_val(self.rows.as_slice())
            + size_of_val(self.indices.as_slice())
            + size_of_val(self.params.as_slice())
            + stiffness
    }
}
