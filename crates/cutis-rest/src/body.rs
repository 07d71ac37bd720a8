//! A body as energies: constraints, weights and loads.

use std::sync::Arc;

use cutis_coloring::{Incidence, Tuples};
use cutis_constraints::Scalar;
use cutis_solver::{Kind, Stiffness, System, Values};
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::RestError;
use crate::energy::{PART, State};
use crate::matrix::is_curved;

/// Mark of a vertex that cannot move.
pub(crate) const FIXED: u32 = u32::MAX;

/// The energies of a system in double precision. Vertices with inverse mass 0 are fixed.
pub struct Body {
    pub(crate) kinds: Vec<Elements>,
    /// The vertices that can move, ascending.
    pub(crate) free: Vec<u32>,
    /// For each vertex its place in `free`, or [`FIXED`].
    pub(crate) place: Vec<u32>,
    /// For each free vertex the free ones that share a constraint with it, and itself, ascending.
    /// The start of each list in `columns`, and the end of the last one.
    pub(crate) starts: Vec<usize>,
    pub(crate) columns: Vec<u32>,
    /// Weight and load of each free vertex in N.
    pub(crate) weights: Vec<Vector3<f64>>,
    /// Origin of the positions, in the caller's coordinates.
    pub(crate) origin: Vector3<f64>,
    /// Positions of all vertices relative to the origin, in m.
    pub(crate) start: Vec<Point3<f64>>,
}

/// The constraints of one kind.
pub(crate) struct Elements {
    pub kind: Kind<f64>,
    compliance: Arc<Values<f64>>,
    /// The constraints that count, ascending. `None` if all do.
    all: Option<Vec<u32>>,
    /// Starts of the parts in `constraints`, and the end of the last one.
    starts: Vec<usize>,
    /// The constraints at the free vertices of each part, ascending.
    constraints: Vec<u32>,
    /// Whether the value is curved as a function of a single vertex.
    pub curved: bool,
}

impl Elements {
    /// `1/α` of a constraint.
    #[inline]
    pub fn stiffness(&self, k: usize) -> f64 {
        1.0 / self.compliance.at(k)
    }

    /// Number of constraints that count.
    pub fn count(&self) -> usize {
        self.all.as_ref().map_or(self.kind.len(), Vec::len)
    }

    /// One of the constraints that count.
    #[inline]
    pub fn nth(&self, n: usize) -> usize {
        self.all.as_ref().map_or(n, |all| all[n] as usize)
    }

    /// The same kind with other lists.
    pub fn with(&self, starts: Vec<usize>, constraints: Vec<u32>, all: Option<Vec<u32>>) -> Self {
        let Self { kind, compliance, curved, .. } = self;
        Self { kind: kind.clone(), compliance: compliance.clone(), all, starts, constraints, curved: *curved }
    }

    /// The constraints at a part of the free vertices, [`PART`] of them.
    #[inline]
    pub fn of_part(&self, part: usize) -> &[u32] {
        &self.constraints[self.starts[part]..self.starts[part + 1]]
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
        let system = system.to_f64();
        let vertices = system.vertices();
        let mut place = vec![FIXED; vertices.len()];
        let (mut free, mut weights) = (Vec::new(), Vec::new());
        for (v, vertex) in vertices.iter().enumerate() {
            if vertex.inverse_mass() > 0.0 {
                place[v] = free.len() as u32;
                free.push(v as u32);
                let load = system.loads().get(v).copied().unwrap_or_default();
                weights.push(Vector3::from(gravity_m_s2) / vertex.inverse_mass() + load);
            }
        }
        if free.is_empty() {
            return Err(RestError::NothingMoves { vertices: vertices.len() });
        }
        let start: Vec<Point3<f64>> = vertices.iter().map(|vertex| vertex.position()).collect();
        let mut kinds = Vec::new();
        let mut incidences = Vec::new();
        for kind in system.kinds() {
            let tuples = Tuples { vertices: kind.indices(), arity: kind.arity() };
            let incidence = Incidence::new(tuples, start.len())?;
            kinds.push(elements(kind.clone(), &start, &free, &incidence)?);
            incidences.push(incidence);
        }
        let (starts, columns) = neighbors(&kinds, &incidences, &free, &place);
        let origin = system.origin().coords;
        Ok(Self { kinds, free, place, starts, columns, weights, origin, start })
    }

    /// Places of the vertices that can move.
    pub(crate) fn places(&self, state: &State) -> Vec<Point3<f64>> {
        self.free.iter().map(|&v| state.x[v as usize]).collect()
    }

    /// Places of the free vertices that share a constraint with that at a place, and itself.
    pub(crate) fn row(&self, place: usize) -> &[u32] {
        &self.columns[self.starts[place]..self.starts[place + 1]]
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
    kind: Kind<f64>,
    start: &[Point3<f64>],
    free: &[u32],
    incidence: &Incidence,
) -> Result<Elements, RestError> {
    let Stiffness::Compliance(compliance) = kind.stiffness().clone() else {
        return Err(RestError::PbdStiffness { kind: kind.name() });
    };
    for constraint in 0..kind.len() {
        let compliance = compliance.at(constraint);
        if !(compliance > 0.0 && (1.0 / compliance).is_finite()) {
            return Err(RestError::Rigid { kind: kind.name(), constraint, compliance });
        }
    }
    let arity = kind.arity().max(1) as u32;
    let of_part = |free: &[u32]| {
        let places = free.iter().flat_map(|&v| incidence.of(v));
        let mut constraints: Vec<u32> = places.map(|place| place / arity).collect();
        constraints.sort_unstable();
        constraints.dedup();
        constraints
    };
    let (starts, constraints) = joined(free.par_chunks(PART).map(of_part).collect());
    let compliance = Arc::new(compliance);
    let mut elements = Elements { kind, compliance, all: None, starts, constraints, curved: false };
    elements.curved = is_curved(&elements, start);
    Ok(elements)
}

/// See [`Body::starts`].
fn neighbors(
    kinds: &[Elements],
    incidences: &[Incidence],
    free: &[u32],
    place: &[u32],
) -> (Vec<usize>, Vec<u32>) {
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
    (starts, columns)
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
