//! Kinematic vertices, which a hand, a hook or a clamp moves along a given path.

use std::collections::HashSet;

use cutis_constraints::Scalar;
use nalgebra::{Point3, Vector3};

use crate::{SolverError, Vertex};

/// A group of vertices that move along a straight path at constant speed and then stay there.
///
/// The vertices get the inverse mass 0 and the position `start + move_m·s`, where `start` is their
/// position when they are grabbed and `s` is `(t − at_s)/over_s` between 0 and 1. If `over_s` is 0,
/// they are at the end of the path from `at_s` on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Handle {
    /// Indices of the vertices to move.
    pub vertices: Vec<u32>,
    /// Displacement at the end of the path, in meters.
    pub move_m: [f64; 3],
    /// Start of the movement, in seconds. The vertices are held before it.
    pub at_s: f64,
    /// Duration of the movement, in seconds.
    pub over_s: f64,
}

/// A validated handle with the positions at which it grabbed its vertices.
#[derive(Clone, Debug)]
pub struct KinematicHandle<T: Scalar> {
    vertices: Vec<u32>,
    start: Vec<Point3<T>>,
    move_m: [f64; 3],
    at_s: f64,
    over_s: f64,
}

impl<T: Scalar> KinematicHandle<T> {
    /// Checks a handle of a system with `vertex_count` vertices. `kinematic` holds the vertices of
    /// all handles so far, and takes those of this one.
    pub(crate) fn check(
        index: usize,
        handle: &Handle,
        vertex_count: usize,
        kinematic: &mut HashSet<u32>,
    ) -> Result<(), SolverError> {
        for value in handle.move_m {
            if !T::constant(value).is_finite() {
                let (key, expected) =
                    ("handle move_m", "three numbers that are finite in the solver's precision");
                return Err(SolverError::Setting { key, value, expected });
            }
        }
        for (key, value) in [("handle at_s", handle.at_s), ("handle over_s", handle.over_s)] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(SolverError::Setting { key, value, expected: "a finite time, 0 s or more" });
            }
        }
        for &vertex in &handle.vertices {
            let error = |reason| Err(SolverError::Handle { handle: index, vertex, reason });
            if vertex as usize >= vertex_count {
                return error("does not exist");
            }
            if !kinematic.insert(vertex) {
                return error("is already moved by another handle");
            }
        }
        Ok(())
    }

    /// Grabs the vertices of a checked handle where they are, and sets their inverse masses to 0.
    pub(crate) fn grab(handle: Handle, vertices: &mut [Vertex<T>]) -> Self {
        let Handle { vertices: grabbed, move_m, at_s, over_s } = handle;
        let grab = |&vertex: &u32| {
            let state = &mut vertices[vertex as usize];
            let position = state.position();
            *state = Vertex::new(position, T::zero());
            position
        };
        let start = grabbed.iter().map(grab).collect();
        Self { vertices: grabbed, start, move_m, at_s, over_s }
    }

    /// Returns the indices of the vertices that the handle moves.
    pub fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// Returns the positions at which the vertices were grabbed, in the order of
    /// [`vertices`](Self::vertices), in meters relative to
    /// [`System::origin`](crate::System::origin).
    pub fn start(&self) -> &[Point3<T>] {
        &self.start
    }

    /// Returns the displacement at `time_s`, in meters.
    pub fn path(&self, time_s: f64) -> Vector3<T> {
        let since = time_s - self.at_s;
        let fraction = match since < self.over_s {
            true => (since / self.over_s).max(0.0),
            false => 1.0,
        };
        Vector3::from(self.move_m.map(|d| T::constant(d * fraction)))
    }

    pub(crate) fn to_f64(&self) -> KinematicHandle<f64> {
        KinematicHandle {
            vertices: self.vertices.clone(),
            start: self.start.iter().map(|position| position.map(T::to_f64)).collect(),
            move_m: self.move_m,
            at_s: self.at_s,
            over_s: self.over_s,
        }
    }

    /// Moves the vertices to their positions at `time_s`.
    pub(crate) fn advance(&self, vertices: &mut [Vertex<T>], time_s: f64) {
        let path = self.path(time_s);
        for (&vertex, start) in self.vertices.iter().zip(&self.start) {
            vertices[vertex as usize].set_position(start + path);
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        size_of_val(self.vertices.as_slice()) + size_of_val(self.start.as_slice())
    }
}
