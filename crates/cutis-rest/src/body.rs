//! A body as energies: constraints, weights and loads.

use std::sync::Arc;

use cutis_coloring::{Incidence, Tuples};
use cutis_constraints::Scalar;
use cutis_solver::System;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::RestError;
use crate::blocks::Pattern;
use crate::constraints::Constraints;
use crate::energy::{PART, State};
use crate::matrix::is_curved;
use crate::order::near_neighbors;

/// Mark of a vertex that cannot move.
pub(crate) const FIXED: u32 = u32::MAX;

/// The energies of a system in double precision. Vertices with inverse mass 0 are fixed.
pub struct Body {
    pub(crate) kinds: Vec<Elements>,
    /// The vertices that can move, in the order of [`near_neighbors`].
    pub(crate) free: Vec<u32>,
    /// For each vertex its place in `free`, or [`FIXED`].
    pub(crate) place: Vec<u32>,
    /// For each free vertex the places of the free ones that share a constraint with it, and its
    /// own, ascending.
    pub(crate) pattern: Arc<Pattern>,
    /// Weight and load of each free vertex in N.
    pub(crate) weights: Vec<Vector3<f64>>,
    /// Origin of the positions, in the caller's coordinates.
    pub(crate) origin: Vector3<f64>,
    /// Positions of all vertices relative to the origin, in m.
    pub(crate) start: Vec<Point3<f64>>,
}

/// The constraints of one kind, by the parts of the free vertices, [`PART`] in each. A part owns a
/// constraint if no part before has one of its vertices.
pub(crate) struct Elements {
    pub kind: Arc<dyn Constraints>,
    /// Starts of the parts in `constraints`, and the end of the last one.
    starts: Vec<usize>,
    /// Number of constraints that each part owns.
    owned: Vec<usize>,
    /// The constraints at the free vertices of each part: those that it owns, ascending, and the
    /// others, ascending.
    constraints: Vec<u32>,
    /// Whether the value is curved as a function of a single vertex.
    pub curved: bool,
}

impl Elements {
    /// The constraints at the vertices that have these places. `lists` has those at each part,
    /// each of them once.
    pub fn new(kind: Arc<dyn Constraints>, curved: bool, place: &[u32], lists: Vec<Vec<u32>>) -> Self {
        let arity = kind.arity();
        let divided = |(part, list): (usize, Vec<u32>)| {
            let owns = |k: &u32| {
                let vertices = &kind.indices()[*k as usize * arity..][..arity];
                vertices.iter().all(|&v| place[v as usize] as usize / PART >= part)
            };
            let (mut list, others): (Vec<u32>, Vec<u32>) = list.into_iter().partition(owns);
            let owned = list.len();
            list.extend(others);
            (owned, list)
        };
        let (owned, lists): (Vec<_>, _) = lists.into_par_iter().enumerate().map(divided).unzip();
        let (starts, constraints) = joined(lists);
        Self { kind, starts, owned, constraints, curved }
    }

    /// The constraints at a part of the free vertices. Those that it owns come first.
    #[inline]
    pub fn of_part(&self, part: usize) -> &[u32] {
        &self.constraints[self.starts[part]..self.starts[part + 1]]
    }

    /// The constraints that a part of the free vertices owns.
    #[inline]
    pub fn owned(&self, part: usize) -> &[u32] {
        &self.constraints[self.starts[part]..][..self.owned[part]]
    }

    /// The vertices of a constraint.
    #[inline]
    pub fn vertices(&self, k: usize) -> &[u32] {
        let arity = self.kind.arity();
        &self.kind.indices()[k * arity..][..arity]
    }
}

impl Body {
    /// The energies of a system, with its positions, parameters, stiffnesses and loads, under a
    /// gravity in m/s².
    ///
    /// # Errors
    /// [`RestError::Value`] for a gravity that is not finite, [`RestError::PbdStiffness`],
    /// [`RestError::Rigid`], [`RestError::NothingMoves`], [`RestError::Incidence`].
    pub fn of<T: Scalar>(system: &System<T>, gravity_m_s2: [f64; 3]) -> Result<Self, RestError> {
        for value in gravity_m_s2 {
            if !value.is_finite() {
                let (what, expected) = ("gravity_m_s2", "three finite numbers");
                return Err(RestError::Value { what, value, expected });
            }
        }
        let vertices = system.vertices();
        let mut place = vec![FIXED; vertices.len()];
        let start: Vec<Point3<f64>> =
            vertices.iter().map(|vertex| vertex.position().map(T::to_f64)).collect();
        let inverse_mass = |v: u32| vertices[v as usize].inverse_mass().to_f64();
        let free: Vec<u32> = (0..vertices.len() as u32).filter(|&v| inverse_mass(v) > 0.0).collect();
        if free.is_empty() {
            return Err(RestError::NothingMoves { vertices: vertices.len() });
        }
        let tuples: Vec<_> = system
            .kinds()
            .iter()
            .map(|kind| Tuples { vertices: kind.indices(), arity: kind.arity() })
            .collect();
        let free = near_neighbors(free, &tuples, vertices.len());
        for (n, &v) in free.iter().enumerate() {
            place[v as usize] = n as u32;
        }
        let weight = |&v: &u32| {
            let load = system.loads().get(v as usize).map(|load| load.map(T::to_f64)).unwrap_or_default();
            Vector3::from(gravity_m_s2) / inverse_mass(v) + load
        };
        let weights = free.iter().map(weight).collect();
        let mut kinds = Vec::new();
        let mut incidences = Vec::new();
        for (kind, &tuples) in system.kinds().iter().zip(&tuples) {
            let incidence = Incidence::new(tuples, start.len())?;
            kinds.push(elements(Arc::new(kind.clone()), &start, &free, &place, &incidence)?);
            incidences.push(incidence);
        }
        let pattern = Arc::new(neighbors(&kinds, &incidences, &free, &place));
        let origin = system.origin().coords.map(T::to_f64);
        Ok(Self { kinds, free, place, pattern, weights, origin, start })
    }

    /// Places of the vertices that can move.
    pub(crate) fn places(&self, state: &State) -> Vec<Point3<f64>> {
        self.free.iter().map(|&v| state.x[v as usize]).collect()
    }

    /// Whether a vertex cannot move.
    pub(crate) fn is_fixed(&self, vertex: usize) -> bool {
        self.place[vertex] == FIXED
    }

    /// Number of vertices that can move.
    pub fn free_count(&self) -> usize {
        self.free.len()
    }
}

fn elements(
    kind: Arc<dyn Constraints>,
    start: &[Point3<f64>],
    free: &[u32],
    place: &[u32],
    incidence: &Incidence,
) -> Result<Elements, RestError> {
    kind.check()?;
    let arity = kind.arity().max(1) as u32;
    let of_part = |free: &[u32]| {
        let places = free.iter().flat_map(|&v| incidence.of(v));
        let mut constraints: Vec<u32> = places.map(|place| place / arity).collect();
        constraints.sort_unstable();
        constraints.dedup();
        constraints
    };
    let lists = free.par_chunks(PART).map(of_part).collect();
    let curved = is_curved(&*kind, start);
    Ok(Elements::new(kind, curved, place, lists))
}

/// See [`Body::pattern`].
fn neighbors(kinds: &[Elements], incidences: &[Incidence], free: &[u32], place: &[u32]) -> Pattern {
    let of_part = |free: &[u32]| -> (Vec<usize>, Vec<u32>) {
        let (mut counts, mut columns, mut row) = (Vec::new(), Vec::new(), Vec::new());
        for &v in free {
            row.clear();
            row.push(place[v as usize]);
            for (elements, incidence) in kinds.iter().zip(incidences) {
                let arity = elements.kind.arity();
                for &at in incidence.of(v) {
                    row.extend(elements.vertices(at as usize / arity).iter().map(|&v| place[v as usize]));
                }
            }
            row.sort_unstable();
            row.dedup();
            // Fixed vertices have the largest mark.
            if row.last() == Some(&FIXED) {
                row.pop();
            }
            counts.push(row.len());
            columns.extend_from_slice(&row);
        }
        (counts, columns)
    };
    let parts: Vec<_> = free.par_chunks(PART).map(of_part).collect();
    let mut starts = vec![0];
    for count in parts.iter().flat_map(|(counts, _)| counts) {
        starts.push(starts[starts.len() - 1] + count);
    }
    let (_, columns) = joined(parts.into_iter().map(|(_, columns)| columns).collect());
    Pattern { starts, columns }
}

/// Lists one after the other: the start of each one, and the end of the last one.
fn joined(lists: Vec<Vec<u32>>) -> (Vec<usize>, Vec<u32>) {
    let mut starts = vec![0];
    let mut all = Vec::with_capacity(lists.iter().map(Vec::len).sum());
    for list in lists {
        all.extend(list);
        starts.push(all.len());
    }
    (starts, all)
}
