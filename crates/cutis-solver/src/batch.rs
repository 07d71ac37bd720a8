//! Storage of one kind of constraint: flat arrays ordered by colour, and the loops over a range of them, scalar for the
//! reference and in lanes for the threads.

use std::marker::PhantomData;
use std::ops::Range;
use std::sync::Arc;

use cutis_coloring::{Groups, Incidence};
use cutis_constraints::{Constraint, Params, Scalar};
use nalgebra::{Point3, Vector3};
use simba::simd::{SimdPartialOrd, SimdValue};

use crate::coloured::SharedVertices;
use crate::{
    ConstraintSet, Kind, Pbd, Pull, Residual, Rule, SolverError, Step, Stiffness, Values, Vertex, Xpbd,
    project,
};

/// Lanes that any number type has at most.
const MOST_LANES: usize = 4;

/// Where a loop over constraints reads vertices.
pub trait Load<T> {
    /// The vertex `index`.
    fn load(&self, index: u32) -> Vertex<T>;
}

/// Where it moves them, too.
pub trait Store<T>: Load<T> {
    /// Replaces the vertex `index`.
    fn store(&mut self, index: u32, vertex: Vertex<T>);
}

impl<T: Copy> Load<T> for &[Vertex<T>] {
    #[inline(always)]
    fn load(&self, index: u32) -> Vertex<T> {
        self[index as usize]
    }
}

impl<T: Copy> Load<T> for &mut [Vertex<T>] {
    #[inline(always)]
    fn load(&self, index: u32) -> Vertex<T> {
        self[index as usize]
    }
}

impl<T: Copy> Store<T> for &mut [Vertex<T>] {
    #[inline(always)]
    fn store(&mut self, index: u32, vertex: Vertex<T>) {
        self[index as usize] = vertex;
    }
}

/// The projections of a kind. Its module is private, so that nothing outside this crate implements or calls it.
pub trait Project<T: Scalar> {
    /// Projects `range` in ascending order. `multipliers` belongs to `range`, or is empty when none are kept.
    fn project(&self, range: Range<usize>, vertices: &mut [Vertex<T>], step: Step<T>, multipliers: &mut [T]);
    /// The same, with vertices that other threads may be moving too: no two constraints in work at a time may share
    /// one.
    fn project_shared(
        &self,
        range: Range<usize>,
        vertices: SharedVertices<'_, T>,
        step: Step<T>,
        multipliers: &mut [T],
    );
    /// Adds what this kind does to each of `chosen` to its place in `pulls`. `incidence` is that of this kind.
    fn pull(&self, incidence: &Incidence, chosen: &[u32], vertices: &[Vertex<T>], pulls: &mut [Pull<T>]);
    /// The same, side by side, with vertices that other threads may be moving too: none that is in a constraint with one
    /// of `chosen`.
    fn pull_shared(
        &self,
        incidence: &Incidence,
        chosen: &[u32],
        vertices: SharedVertices<'_, T>,
        pulls: &mut [Pull<T>],
    );
    /// Number of vertices that the indices were checked against.
    fn vertex_count(&self) -> usize;
}

/// All constraints of the kind `C`. No two of one colour share a vertex; every index is below `vertex_count`.
pub(crate) struct Batch<C, const N: usize, T, P> {
    vertex_count: usize,
    offsets: Vec<u32>,
    indices: Vec<[u32; N]>,
    params: Vec<P>,
    stiffness: Stiffness<T>,
    kind: PhantomData<fn() -> C>,
}

impl<C: Constraint<N>, const N: usize, T: Scalar> Batch<C, N, T, C::Params<T>> {
    /// Checks everything that the inner loops rely on, then sorts the constraints by colour.
    pub(crate) fn new(
        vertex_count: usize,
        indices: &[[u32; N]],
        params: &[C::Params<T>],
        stiffness: Stiffness<T>,
        groups: &Groups,
    ) -> Result<Self, SolverError> {
        let kind = C::NAME;
        let count = indices.len();
        if u32::try_from(count).is_err() {
            return Err(SolverError::TooMany { what: "constraints", count });
        }
        if params.len() != count {
            let (what, found) = ("parameter sets", params.len());
            return Err(SolverError::KindLength { kind, what, found, expected: count });
        }
        for (constraint, (tuple, params)) in indices.iter().zip(params).enumerate() {
            check_tuple(kind, constraint, tuple, vertex_count)?;
            for (parameter, value) in params.as_ref().iter().enumerate() {
                let value = value.to_f64();
                if !value.is_finite() {
                    return Err(SolverError::Parameter { kind, constraint, parameter, value });
                }
            }
        }
        groups
            .verify(indices, vertex_count)
            .map_err(|error| SolverError::Groups { kind, reason: error.to_string() })?;
        let order = &groups.order;
        Ok(Self {
            vertex_count,
            offsets: groups.offsets.clone(),
            indices: order.iter().map(|&k| indices[k as usize]).collect(),
            params: order.iter().map(|&k| params[k as usize]).collect(),
            stiffness: stiffness.validated(kind, count, order)?,
            kind: PhantomData,
        })
    }

    fn positions(&self, k: usize, vertices: &[Vertex<T>]) -> [Point3<T>; N] {
        self.indices[k].map(|i| vertices[i as usize].position())
    }

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

    /// Projects constraints of one colour side by side, as many at once as there are lanes, and the rest one by one:
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

/// How constraints act on single vertices.
impl<C: Constraint<N>, const N: usize, T: Scalar> Batch<C, N, T, C::Params<T>> {
    /// Adds to `pull` what the constraints at `places` do to one vertex, in ascending order.
    #[inline(always)]
    fn pull_one_by_one<L: Load<T>>(&self, places: &[u32], load: &L, pull: &mut Pull<T>) {
        let stiffness = self.stiffness.values();
        for &place in places {
            let (k, slot) = (place as usize / N, place as usize % N);
            let x = self.indices[k].map(|i| load.load(i).position());
            let eval = C::eval(&x, &self.params[k]);
            pull.add(eval.c, &eval.grad[slot], stiffness.at(k), C::rest_size(&self.params[k]));
        }
    }

    /// The same for several vertices side by side, as long as each of them has constraints left, and the rest one by one.
    #[inline(always)]
    fn pull_side_by_side<L: Load<T>>(&self, places: &[&[u32]], load: &L, pulls: &mut [Pull<T>]) {
        let stiffness = self.stiffness.values();
        let common = places.iter().map(|places| places.len()).min().unwrap_or(0);
        let vector = |part: fn(&Pull<T>) -> &Vector3<T>, pulls: &[Pull<T>]| {
            Vector3::from_fn(|axis, _| T::lanes(|lane| part(&pulls[lane])[axis]))
        };
        let mut sum = Pull {
            force: vector(|pull| &pull.force, pulls),
            diagonal: vector(|pull| &pull.diagonal, pulls),
            mixed: vector(|pull| &pull.mixed, pulls),
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
        for (lane, (pull, places)) in pulls.iter_mut().zip(places).enumerate() {
            *pull = Pull {
                force: sum.force.map(|component| component.extract(lane)),
                diagonal: sum.diagonal.map(|component| component.extract(lane)),
                mixed: sum.mixed.map(|component| component.extract(lane)),
            };
            self.pull_one_by_one(&places[common..], load, pull);
        }
    }
}

fn check_tuple(
    kind: &'static str,
    constraint: usize,
    tuple: &[u32],
    vertex_count: usize,
) -> Result<(), SolverError> {
    for (i, &vertex) in tuple.iter().enumerate() {
        if vertex as usize >= vertex_count {
            return Err(SolverError::VertexOutOfRange { kind, constraint, vertex, vertex_count });
        }
        if tuple[..i].contains(&vertex) {
            return Err(SolverError::RepeatedVertex { kind, constraint, vertex });
        }
    }
    Ok(())
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

    fn pull(&self, incidence: &Incidence, chosen: &[u32], vertices: &[Vertex<T>], pulls: &mut [Pull<T>]) {
        for (&vertex, pull) in chosen.iter().zip(pulls) {
            self.pull_one_by_one(incidence.of(vertex), &vertices, pull);
        }
    }

    fn pull_shared(
        &self,
        incidence: &Incidence,
        chosen: &[u32],
        vertices: SharedVertices<'_, T>,
        pulls: &mut [Pull<T>],
    ) {
        let lanes = T::Lanes::LANES;
        let mut places: [&[u32]; MOST_LANES] = [&[]; MOST_LANES];
        for (chosen, pulls) in chosen.chunks(lanes).zip(pulls.chunks_mut(lanes)) {
            if chosen.len() == lanes {
                for (places, &vertex) in places.iter_mut().zip(chosen) {
                    *places = incidence.of(vertex);
                }
                self.pull_side_by_side(&places[..lanes], &vertices, pulls);
            } else {
                for (&vertex, pull) in chosen.iter().zip(pulls) {
                    self.pull_one_by_one(incidence.of(vertex), &vertices, pull);
                }
            }
        }
    }

    fn vertex_count(&self) -> usize {
        self.vertex_count
    }
}

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
            let free = |&i: &usize| vertices[self.indices[k][i] as usize].inverse_mass() > T::zero();
            let mut movable = (0..N).filter(free).peekable();
            let cannot_act = movable.peek().is_some() && movable.all(|i| eval.grad[i] == Vector3::zeros());
            (ratio.is_finite() && ratio.abs() > tolerance && cannot_act).then_some((k, ratio))
        })
    }

    fn evaluate(&self, k: usize, x: &[Point3<f64>], grad: &mut [Vector3<f64>]) -> f64 {
        let params = self.params[k].as_ref();
        let params = <C::Params<f64> as Params<f64>>::from_fn(|j| params[j].to_f64());
        let eval = C::eval(&std::array::from_fn(|i| x[i]), &params);
        grad.copy_from_slice(&eval.grad);
        eval.c
    }

    fn to_f64(&self) -> Kind<f64> {
        let wide =
            |params: &C::Params<T>| <C::Params<f64> as Params<f64>>::from_fn(|j| params.as_ref()[j].to_f64());
        Arc::new(Batch::<C, N, f64, C::Params<f64>> {
            vertex_count: self.vertex_count,
            offsets: self.offsets.clone(),
            indices: self.indices.clone(),
            params: self.params.iter().map(wide).collect(),
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
            + size_of_val(self.indices.as_slice())
            + size_of_val(self.params.as_slice())
            + stiffness
    }
}
