//! A body as energies: constraints, weights and loads.

use cutis_coloring::{Incidence, Tuples};
use cutis_constraints::Scalar;
use cutis_solver::{Kind, Stiffness, System, Values};
use nalgebra::{Point3, Vector3};

use crate::RestError;
use crate::energy::State;

/// Mark of a vertex that cannot move.
pub(crate) const FIXED: u32 = u32::MAX;

/// The energies of a system in double precision. Vertices with inverse mass 0 are fixed.
pub struct Body {
    pub(crate) kinds: Vec<Elements>,
    /// The vertices that can move, ascending.
    pub(crate) free: Vec<u32>,
    /// For each vertex its place in `free`, or [`FIXED`].
    pub(crate) place: Vec<u32>,
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
    compliance: Values<f64>,
    /// The constraints at each vertex.
    pub incidence: Incidence,
    /// Whether the value is curved as a function of a single vertex.
    pub curved: bool,
}

impl Elements {
    /// `1/α` of a constraint.
    #[inline]
    pub fn stiffness(&self, k: usize) -> f64 {
        1.0 / self.compliance.at(k)
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
        let kinds = system.kinds().iter().map(|kind| elements(kind.clone(), &start));
        Ok(Self {
            kinds: kinds.collect::<Result<_, _>>()?,
            free,
            place,
            weights,
            origin: system.origin().coords,
            start,
        })
    }

    /// Places of the vertices that can move.
    pub(crate) fn places(&self, state: &State) -> Vec<Point3<f64>> {
        self.free.iter().map(|&v| state.x[v as usize]).collect()
    }

    /// Number of vertices that can move.
    pub fn free_count(&self) -> usize {
        self.free.len()
    }
}

fn elements(kind: Kind<f64>, start: &[Point3<f64>]) -> Result<Elements, RestError> {
    let Stiffness::Compliance(compliance) = kind.stiffness().clone() else {
        return Err(RestError::PbdStiffness { kind: kind.name() });
    };
    for constraint in 0..kind.len() {
        let compliance = compliance.at(constraint);
        if !(compliance > 0.0 && (1.0 / compliance).is_finite()) {
            return Err(RestError::Rigid { kind: kind.name(), constraint, compliance });
        }
    }
    let tuples = Tuples { vertices: kind.indices(), arity: kind.arity() };
    let incidence = Incidence::new(tuples, start.len())?;
    let mut elements = Elements { kind, compliance, incidence, curved: false };
    elements.curved = crate::hessian::is_curved(&elements, start);
    Ok(elements)
}
