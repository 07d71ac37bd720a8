//! The passes over vertices: prediction, velocity update, and both combined between two substeps.

use cutis_constraints::Scalar;
use nalgebra::{Point3, Vector3};

use crate::columns::ColumnBlock;
use crate::loads::load_of;
use crate::{Formulation, Settings, Vertex};

/// A range of vertices, as slices of the vertex arrays.
pub struct VertexBlock<'a, T: Scalar> {
    /// Positions and inverse masses.
    pub vertices: &'a mut [Vertex<T>],
    /// Positions at the start of the substep.
    pub previous: &'a mut [Point3<T>],
    /// Velocities in m/s. They are up to date between calls of `step`, but not between the substeps
    /// of one call.
    pub velocities: &'a mut [Vector3<T>],
    /// Constant forces in N; empty if there are none.
    pub loads: &'a [Vector3<T>],
    /// The vertices by column, if a step keeps them in this form.
    pub(crate) columns: Option<ColumnBlock<'a, T>>,
}

impl<'a, T: Scalar> VertexBlock<'a, T> {
    /// Returns the number of vertices.
    pub fn len(&self) -> usize {
        self.vertices.len()
    }

    /// True if there are no vertices.
    pub fn is_empty(&self) -> bool {
        self.vertices.is_empty()
    }

    /// Splits the block into the first `middle` vertices and the rest.
    ///
    /// # Panics
    /// Panics if there are fewer than `middle` vertices, or if `middle` is odd.
    pub fn split_at(self, middle: usize) -> (Self, Self) {
        assert!(middle.is_multiple_of(2), "vertices by column are divided in pairs");
        let (vertices, later_vertices) = self.vertices.split_at_mut(middle);
        let (previous, later_previous) = self.previous.split_at_mut(middle);
        let (velocities, later_velocities) = self.velocities.split_at_mut(middle);
        let (loads, later_loads) = self.loads.split_at(middle.min(self.loads.len()));
        let (columns, later_columns) = self.columns.map(|columns| columns.split_at(middle)).unzip();
        let later = Self {
            vertices: later_vertices,
            previous: later_previous,
            velocities: later_velocities,
            loads: later_loads,
            columns: later_columns,
        };
        (Self { vertices, previous, velocities, loads, columns }, later)
    }
}

/// A pass over all vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VertexPass {
    /// Sets `v += h·(g + load/m)`, `p = x`, `x += h·v`, with the stored velocities.
    Predict,
    /// Combines [`Finish`](Self::Finish) and [`Predict`](Self::Predict) without storing `v`.
    FinishAndPredict,
    /// Stores `v = (x − p)/h · exp(−damping·h)`.
    Finish,
    /// Sets `x = p`, `v = 0`: returns to the start of the substep, at rest.
    Restore,
}

/// Constants of a substep in the solver's number type.
#[derive(Clone, Copy, Debug)]
pub struct Integrator<T> {
    /// Length `h` of a substep in s.
    pub h: T,
    /// `exp(−damping·h)/h` in 1/s, the factor from a displacement to a velocity.
    pub velocity_factor: T,
    /// Gravity times `h`, in m/s. Zero for vertex block descent, which includes gravity in the
    /// energy of the step, see
    /// [`DescentStep::gravity_h_squared`](crate::DescentStep::gravity_h_squared).
    pub gravity_h: Vector3<T>,
    /// `h`, or zero for vertex block descent, which includes the loads in the forces on a vertex.
    pub load_h: T,
}

impl<T: Scalar> Integrator<T> {
    pub(crate) fn new(settings: &Settings) -> Self {
        let h = settings.substep_s();
        let predicted = if settings.formulation == Formulation::Vbd { 0.0 } else { h };
        Self {
            h: T::constant(h),
            velocity_factor: T::constant((-settings.damping_per_s * h).exp() / h),
            gravity_h: Vector3::from(settings.gravity_m_s2.map(|g| T::constant(g * predicted))),
            load_h: T::constant(predicted),
        }
    }

    #[inline]
    fn finish(&self, vertex: &Vertex<T>, previous: &Point3<T>) -> Vector3<T> {
        (vertex.position() - previous) * self.velocity_factor
    }

    #[inline]
    fn predict(
        &self,
        vertex: &mut Vertex<T>,
        previous: &mut Point3<T>,
        velocity: Vector3<T>,
        load: Vector3<T>,
    ) {
        let x = vertex.position();
        *previous = x;
        let w = vertex.inverse_mass();
        if w > T::zero() {
            let pushed = velocity + self.gravity_h + load * (w * self.load_h);
            vertex.set_position(x + pushed * self.h);
        }
    }

    /// Runs one pass over a block. Vertices do not depend on each other, so the result does not
    /// depend on the size of the blocks.
    pub(crate) fn run(&self, pass: VertexPass, block: VertexBlock<'_, T>) {
        let VertexBlock { vertices, previous, velocities, loads, columns } = block;
        match columns {
            Some(columns) => self.run_by_column(pass, columns, vertices, previous, velocities, loads),
            None => self.run_in_place(pass, vertices, previous, velocities, loads),
        }
    }

    fn run_in_place(
        &self,
        pass: VertexPass,
        vertices: &mut [Vertex<T>],
        previous: &mut [Point3<T>],
        velocities: &mut [Vector3<T>],
        loads: &[Vector3<T>],
    ) {
        let positions = vertices.iter_mut().zip(previous);
        match pass {
            VertexPass::Predict => {
                for (i, ((x, p), v)) in positions.zip(velocities).enumerate() {
                    self.predict(x, p, *v, load_of(loads, i));
                }
            }
            VertexPass::FinishAndPredict => {
                for (i, (x, p)) in positions.enumerate() {
                    let v = self.finish(x, p);
                    self.predict(x, p, v, load_of(loads, i));
                }
            }
            VertexPass::Finish => {
                for ((x, p), v) in positions.zip(velocities) {
                    *v = self.finish(x, p);
                }
            }
            VertexPass::Restore => {
                for ((x, p), v) in positions.zip(velocities) {
                    x.set_position(*p);
                    *v = Vector3::zeros();
                }
            }
        }
    }

    /// The first prediction reads `vertices`, and the last velocity update writes them. In between
    /// only the columns are up to date.
    fn run_by_column(
        &self,
        pass: VertexPass,
        mut columns: ColumnBlock<'_, T>,
        vertices: &mut [Vertex<T>],
        previous: &mut [Point3<T>],
        velocities: &mut [Vector3<T>],
        loads: &[Vector3<T>],
    ) {
        let count = vertices.len();
        let (previous, velocities) = (&mut previous[..count], &mut velocities[..count]);
        match pass {
            VertexPass::Predict => columns.update(count, |i, _| {
                let mut x = vertices[i];
                self.predict(&mut x, &mut previous[i], velocities[i], load_of(loads, i));
                x
            }),
            VertexPass::FinishAndPredict => columns.update(count, |i, mut x| {
                let v = self.finish(&x, &previous[i]);
                self.predict(&mut x, &mut previous[i], v, load_of(loads, i));
                x
            }),
            VertexPass::Finish => columns.update(count, |i, x| {
                vertices[i] = x;
                velocities[i] = self.finish(&x, &previous[i]);
                x
            }),
            VertexPass::Restore => self.run_in_place(pass, vertices, previous, velocities, loads),
        }
    }
}
