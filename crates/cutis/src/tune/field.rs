//! Displacement fields of the movable vertices, and the distance between two fields.

use cutis_constraints::Scalar;
use cutis_solver::System;
use nalgebra::{Point3, Vector3};

/// Rounding error of a position over the body's extent.
const ROUNDING: f64 = 1e-6;

/// The movable vertices and their rest positions in local meters.
pub(super) struct Movable {
    vertices: Vec<u32>,
    rest: Vec<Point3<f64>>,
}

/// One displacement per movable vertex, meters.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Field(pub(super) Vec<Vector3<f32>>);

impl Movable {
    pub(super) fn of(system: &System<f32>) -> Self {
        let moves = |(v, vertex): (usize, &cutis_solver::Vertex<f32>)| {
            (vertex.inverse_mass() > 0.0).then_some(v as u32)
        };
        let vertices: Vec<u32> = system.vertices().iter().enumerate().filter_map(moves).collect();
        let positions = system.positions();
        let rest = vertices.iter().map(|&v| positions[v as usize].cast()).collect();
        Self { vertices, rest }
    }

    /// Indices of the movable vertices, ascending.
    pub(super) fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// Longest side of the bounding box at rest, meters.
    fn extent(&self) -> f64 {
        let side = |axis: usize| {
            let values = self.rest.iter().map(|position| position[axis]);
            let hull = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            hull.1 - hull.0
        };
        (0..3).map(side).fold(0.0, f64::max)
    }

    /// Displacements up to this length, meters, are rounding errors of the `f32` rest shape.
    pub(super) fn rounding(&self) -> f64 {
        ROUNDING * self.extent()
    }

    /// The displacement field of `positions`, which has one entry per vertex of the body.
    pub(super) fn field<T: Scalar>(&self, positions: &[Point3<T>]) -> Field {
        let moved = |(&v, rest): (&u32, &Point3<f64>)| {
            let now = positions[v as usize].map(T::to_f64);
            (now - rest).map(|d| d as f32)
        };
        Field(self.vertices.iter().zip(&self.rest).map(moved).collect())
    }
}

impl Field {
    /// Root mean square of the displacements, meters.
    pub(super) fn rms(&self) -> f64 {
        self.mean(self.0.iter().map(|d| d.map(f64::from).norm_squared()))
    }

    /// Root mean square of the differences to another field of the same vertices, meters.
    pub(super) fn rms_to(&self, other: &Self) -> f64 {
        let apart =
            |(a, b): (&Vector3<f32>, &Vector3<f32>)| (a.map(f64::from) - b.map(f64::from)).norm_squared();
        self.mean(self.0.iter().zip(&other.0).map(apart))
    }

    /// `self + factor·(self − before)`.
    pub(super) fn beyond(&self, before: &Self, factor: f64) -> Self {
        let factor = factor as f32;
        Self(self.0.iter().zip(&before.0).map(|(now, before)| now + (now - before) * factor).collect())
    }

    fn mean(&self, squares: impl Iterator<Item = f64>) -> f64 {
        (squares.sum::<f64>() / self.0.len().max(1) as f64).sqrt()
    }
}
