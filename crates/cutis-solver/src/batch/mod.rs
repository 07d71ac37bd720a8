//! Storage of one kind of constraint: flat arrays ordered by color. All values are checked when
//! the storage is built.

mod access;
mod project;
mod runs;
mod set;
mod tiles;
mod vertex_force;

use std::marker::PhantomData;
use std::ops::Range;

use cutis_coloring::{Groups, Incidence};
use cutis_constraints::{Constraint, Eval, Params, Scalar, SimdLevel};
use nalgebra::{Point3, Vector3};

use crate::colored::{SharedStore, SharedVertices};
use crate::teams::TeamConstraints;
use crate::{SolverError, Step, Stiffness, Vertex, VertexForce, VertexStore};

use runs::Runs;
use tiles::Tiles;

pub use access::{LaneAccess, Load, Store};
pub(crate) use runs::{QUAD, ROW, RUNS};
pub use vertex_force::TeamForces;

/// Upper bound of the number of SIMD lanes over all levels and number types.
const MAX_LANES: usize = 16;

/// A range of constraints of one kind, to be projected with the vertices `V`.
pub struct ConstraintChunk<'a, T, V> {
    /// Constraints in the order of the colors.
    pub range: Range<usize>,
    /// All vertices of the system.
    pub vertices: V,
    /// Parameters of the substep.
    pub step: Step<T>,
    /// One multiplier per constraint of `range`; empty if none are stored.
    pub multipliers: &'a mut [T],
}

/// Vertices on which the forces of one kind are evaluated, at the state `V`.
pub struct VertexChunk<'a, T, V> {
    /// The constraints of this kind at each vertex.
    pub incidence: &'a Incidence,
    /// Indices of the vertices.
    pub indices: &'a [u32],
    /// All vertices of the system.
    pub vertices: V,
    /// One force per entry of `indices`, to which this kind adds its part.
    pub forces: &'a mut [VertexForce<T>],
}

/// The inner loops of one kind. The module is private, so that code outside of this crate can
/// neither implement nor call this trait.
pub trait Project<T: Scalar> {
    /// Projects the constraints one after the other, in ascending order.
    fn project(&self, chunk: ConstraintChunk<'_, T, VertexStore<'_, T>>);
    /// Projects with SIMD lanes while other threads project other constraints. No two constraints
    /// that are projected at the same time may share a vertex.
    fn project_shared(&self, level: SimdLevel, chunk: ConstraintChunk<'_, T, SharedStore<'_, T>>);
    /// Divides the constraints of a color in one tile by the length of the pieces in which they are
    /// projected. Each of the ranges is in the order of the body, so that equal parts of all ranges
    /// are about the same part of the body.
    fn runs(&self, range: Range<usize>) -> [Range<usize>; RUNS];
    /// Adds the forces of this kind on each vertex, one vertex after the other.
    fn vertex_forces(&self, chunk: VertexChunk<'_, T, &[Vertex<T>]>);
    /// Adds the force of each constraint to all of its vertices, one constraint after the other.
    /// Each vertex gets the same sum as from `vertex_forces`.
    fn add_forces(&self, vertices: &[Vertex<T>], forces: &mut [Vector3<T>]);
    /// Adds the forces with SIMD lanes while other threads move other vertices. No thread may
    /// move a vertex that shares a constraint with a vertex of this chunk.
    fn vertex_forces_shared(&self, level: SimdLevel, chunk: VertexChunk<'_, T, SharedVertices<'_, T>>);
    /// Adds the forces on the vertices of a team with SIMD lanes.
    fn team_forces(&self, level: SimdLevel, team: &TeamConstraints<'_, T>, forces: &mut TeamForces<T>);
    /// Returns the number of vertices for which the indices were checked.
    fn vertex_count(&self) -> usize;
}

/// All constraints of the kind `C`. Two constraints of one color never share a vertex, and every
/// index is below `vertex_count`.
pub(crate) struct Batch<C, const N: usize, T, P> {
    vertex_count: usize,
    offsets: Vec<u32>,
    tiles: Tiles,
    runs: Runs,
    /// The vertices of the first constraint of each long piece of `runs`, so that loops over pieces
    /// read less memory.
    rows: Vec<[u32; N]>,
    indices: Vec<[u32; N]>,
    params: Vec<P>,
    stiffness: Stiffness<T>,
    kind: PhantomData<fn() -> C>,
}

impl<C: Constraint<N>, const N: usize, T: Scalar> Batch<C, N, T, C::Params<T>> {
    /// Checks everything that the inner loops rely on, then sorts the constraints by color, tile
    /// and run.
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
        let (tiles, mut order) = tiles::divide(indices, groups, vertex_count);
        let (mut runs, mut scratch) = (Runs::default(), runs::Scratch::default());
        let offsets = if tiles.count == 1 { &groups.offsets } else { &tiles.offsets };
        for part in offsets.windows(2).map(|part| part[0] as usize..part[1] as usize) {
            let start = part.start;
            runs::arrange(&mut order[part], start, indices, &mut runs, &mut scratch);
        }
        Ok(Self {
            vertex_count,
            offsets: groups.offsets.clone(),
            tiles,
            rows: runs.rows(count).map(|place| indices[order[place] as usize]).collect(),
            runs,
            indices: order.iter().map(|&k| indices[k as usize]).collect(),
            params: order.iter().map(|&k| params[k as usize]).collect(),
            stiffness: stiffness.validated(kind, count, &order)?,
            kind: PhantomData,
        })
    }

    fn positions(&self, k: usize, vertices: &[Vertex<T>]) -> [Point3<T>; N] {
        self.indices[k].map(|i| vertices[i as usize].position())
    }

    /// Evaluates a constraint in double precision, with its vertices at `x`.
    #[inline(always)]
    fn evaluated(&self, k: usize, x: &[Point3<f64>; N]) -> Eval<f64, N> {
        let params = self.params[k].as_ref();
        C::eval(x, &Params::from_fn(|j| params[j].to_f64()))
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
