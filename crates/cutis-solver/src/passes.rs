//! The passes over vertices: prediction, velocity update, and both in one where a substep follows another.

use cutis_constraints::Scalar;
use nalgebra::{Point3, Vector3};

use crate::{Formulation, Settings, Vertex};

/// The same range of the three vertex arrays.
pub struct VertexBlock<'a, T: Scalar> {
    /// Positions and inverse masses.
    pub vertices: &'a mut [Vertex<T>],
    /// Positions at the start of the substep.
    pub previous: &'a mut [Point3<T>],
    /// Velocities in m/s; up to date between calls of `step`, not between the substeps of one call.
    pub velocities: &'a mut [Vector3<T>],
}

impl<'a, T: Scalar> VertexBlock<'a, T> {
    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.vertices.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.vertices.is_empty()
    }

    /// The first `middle` vertices and the rest.
    ///
    /// # Panics
    /// If there are fewer than `middle`.
    pub fn split_at(self, middle: usize) -> (Self, Self) {
        let (vertices, later_vertices) = self.vertices.split_at_mut(middle);
        let (previous, later_previous) = self.previous.split_at_mut(middle);
        let (velocities, later_velocities) = self.velocities.split_at_mut(middle);
        let later = Self { vertices: later_vertices, previous: later_previous, velocities: later_velocities };
        (Self { vertices, previous, velocities }, later)
    }
}

/// Which pass over the vertices is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// `v += h·g`, `p = x`, `x += h·v`, from the stored velocities.
    Predict,
    /// [`Finish`](Self::Finish) and [`Predict`](Self::Predict) at once, without a trip of `v` through memory.
    FinishAndPredict,
    /// `v = (x − p)/h · exp(−damping·h)`, stored.
    Finish,
    /// `x = p`, `v = 0`: back to the start of the substep, at rest.
    Restore,
}

/// The numbers of a substep in the solver's own type.
#[derive(Clone, Copy, Debug)]
pub struct Integrator<T> {
    /// Length of a substep, `h`, in s.
    pub h: T,
    /// `exp(−damping·h)/h` in 1/s: from a displacement to a velocity.
    pub velocity_factor: T,
    /// Gravity times `h`, in m/s; zero for vertex block descent, where gravity is in the energy of the step
    /// ([`DescentStep::fall`](crate::DescentStep::fall)).
    pub gravity_h: Vector3<T>,
}

impl<T: Scalar> Integrator<T> {
    pub(crate) fn new(settings: &Settings) -> Self {
        let h = settings.substep_s();
        let predicted = if settings.formulation == Formulation::Vbd { 0.0 } else { h };
        Self {
            h: T::constant(h),
            velocity_factor: T::constant((-settings.damping_per_s * h).exp() / h),
            gravity_h: Vector3::from(settings.gravity_m_s2.map(|g| T::constant(g * predicted))),
        }
    }

    #[inline]
    fn finish(&self, vertex: &Vertex<T>, previous: &Point3<T>) -> Vector3<T> {
        (vertex.position() - previous) * self.velocity_factor
    }

    #[inline]
    fn predict(&self, vertex: &mut Vertex<T>, previous: &mut Point3<T>, velocity: Vector3<T>) {
        let x = vertex.position();
        *previous = x;
        if vertex.inverse_mass() > T::zero() {
            vertex.set_position(x + (velocity + self.gravity_h) * self.h);
        }
    }

    /// Runs one pass over a block. Every vertex is on its own, so that the blocks' sizes do not matter.
    pub(crate) fn run(&self, motion: Motion, block: VertexBlock<'_, T>) {
        let VertexBlock { vertices, previous, velocities } = block;
        let places = vertices.iter_mut().zip(previous);
        match motion {
            Motion::Predict => {
                for ((x, p), v) in places.zip(velocities) {
                    self.predict(x, p, *v);
                }
            }
            Motion::FinishAndPredict => {
                for (x, p) in places {
                    let v = self.finish(x, p);
                    self.predict(x, p, v);
                }
            }
            Motion::Finish => {
                for ((x, p), v) in places.zip(velocities) {
                    *v = self.finish(x, p);
                }
            }
            Motion::Restore => {
                for ((x, p), v) in places.zip(velocities) {
                    x.set_position(*p);
                    *v = Vector3::zeros();
                }
            }
        }
    }
}
