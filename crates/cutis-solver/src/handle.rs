//! Kinematic vertices: what a hand, a hook or a clamp moves along a given path.

use std::collections::HashSet;

use cutis_constraints::Scalar;
use nalgebra::{Point3, Vector3};

use crate::{SolverError, Vertex};

/// A group of vertices that move a straight path at constant speed, then held.
///
/// Its vertices take the inverse mass 0 and the position `rest + move_m·min(t/over_s, 1)`; with `over_s` 0 they are
/// at the end of their path from the first substep on.
#[derive(Clone, Debug, PartialEq)]
pub struct Handle {
    /// The vertices it moves.
    pub vertices: Vec<u32>,
    /// The whole path in meters.
    pub move_m: [f64; 3],
    /// Time that the path takes, in seconds.
    pub over_s: f64,
}

/// A checked handle with the rest positions of its vertices.
#[derive(Clone, Debug)]
pub struct KinematicHandle<T: Scalar> {
    vertices: Vec<u32>,
    rest: Vec<Point3<T>>,
    move_m: [f64; 3],
    over_s: f64,
}

impl<T: Scalar> KinematicHandle<T> {
    /// Checks the numbers of `handle` and takes its vertices out of the dynamics. `taken` are those of other handles.
    pub(crate) fn new(
        index: usize,
        handle: Handle,
        vertices: &mut [Vertex<T>],
        taken: &mut HashSet<u32>,
    ) -> Result<Self, SolverError> {
        for value in handle.move_m {
            if !T::constant(value).is_finite() {
                let (key, expected) =
                    ("handle move_m", "three numbers that are finite in the solver's precision");
                return Err(SolverError::Setting { key, value, expected });
            }
        }
        if !(handle.over_s.is_finite() && handle.over_s >= 0.0) {
            let (key, expected) = ("handle over_s", "a finite time, 0 s or more");
            return Err(SolverError::Setting { key, value: handle.over_s, expected });
        }
        let mut rest = Vec::with_capacity(handle.vertices.len());
        for &vertex in &handle.vertices {
            let error = |reason| SolverError::Handle { handle: index, vertex, reason };
            let place = vertices.get_mut(vertex as usize).ok_or_else(|| error("does not exist"))?;
            if !taken.insert(vertex) {
                return Err(error("is moved by a handle already"));
            }
            rest.push(place.position());
            *place = Vertex::new(place.position(), T::zero());
        }
        Ok(Self { vertices: handle.vertices, rest, move_m: handle.move_m, over_s: handle.over_s })
    }

    /// The vertices it moves.
    pub fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// Where they began, relative to [`System::origin`](crate::System::origin), in the order of
    /// [`vertices`](Self::vertices).
    pub fn rest(&self) -> &[Point3<T>] {
        &self.rest
    }

    /// How far they have come at `time_s`, in meters.
    pub fn path(&self, time_s: f64) -> Vector3<T> {
        let share = if time_s < self.over_s { time_s / self.over_s } else { 1.0 };
        Vector3::from(self.move_m.map(|d| T::constant(d * share)))
    }

    pub(crate) fn to_f64(&self) -> KinematicHandle<f64> {
        KinematicHandle {
            vertices: self.vertices.clone(),
            rest: self.rest.iter().map(|place| place.map(T::to_f64)).collect(),
            move_m: self.move_m,
            over_s: self.over_s,
        }
    }

    /// Puts the vertices where they are at `time_s`.
    pub(crate) fn advance(&self, vertices: &mut [Vertex<T>], time_s: f64) {
        let path = self.path(time_s);
        for (&vertex, rest) in self.vertices.iter().zip(&self.rest) {
            vertices[vertex as usize].set_position(rest + path);
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        size_of_val(self.vertices.as_slice()) + size_of_val(self.rest.as_slice())
    }
}
