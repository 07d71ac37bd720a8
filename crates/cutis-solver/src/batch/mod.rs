//! Storage of one kind of constraint: flat arrays ordered by color, checked when they are made.

mod access;
mod project;
mod set;
mod vertex_force;

use std::marker::PhantomData;
use std::ops::Range;

use cutis_coloring::{Groups, Incidence};
use cutis_constraints::{Constraint, Scalar};
use nalgebra::Point3;

use crate::colored::SharedVertices;
use crate::{SolverError, Step, Stiffness, Vertex, VertexForce};

pub use access::{Load, Store};

/// Lanes that any number type has at most.
const MOST_LANES: usize = 4;

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
    /// Adds what this kind does to each of `chosen` to its place in `forces`. `incidence` is that of this kind.
    fn vertex_force(
        &self,
        incidence: &Incidence,
        chosen: &[u32],
        vertices: &[Vertex<T>],
        forces: &mut [VertexForce<T>],
    );
    /// The same, side by side, with vertices that other threads may be moving too: none that is in a constraint with one
    /// of `chosen`.
    fn pull_shared(
        &self,
        incidence: &Incidence,
        chosen: &[u32],
        vertices: SharedVertices<'_, T>,
        forces: &mut [VertexForce<T>],
    );
    /// Number of vertices that the indices were checked against.
    fn vertex_count(&self) -> usize;
}

/// All constraints of the kind `C`. No two of one color share a vertex; every index is below `vertex_count`.
pub(crate) struct Batch<C, const N: usize, T, P> {
    vertex_count: usize,
    offsets: Vec<u32>,
    indices: Vec<[u32; N]>,
    params: Vec<P>,
    stiffness: Stiffness<T>,
    kind: PhantomData<fn() -> C>,
}

impl<C: Constraint<N>, const N: usize, T: Scalar> Batch<C, N, T, C::Params<T>> {
    /// Checks everything that the inner loops rely on, then sorts the constraints by color.
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
