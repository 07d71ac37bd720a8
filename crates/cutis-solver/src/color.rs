//! The work on one color: constraints to project or vertices to move, with serial versions in safe
//! code.

use std::ops::Range;

use cutis_constraints::Scalar;

use crate::batch::{ConstraintChunk, VertexChunk};
use crate::loads::load_of;
use crate::{ColorPass, Columns, ConstraintSet, Descent, Step, System, Vertex, VertexForce};

/// The vertices of a system, in one of two forms.
pub enum VertexStore<'a, T> {
    /// One vertex after the other.
    Vertices(&'a mut [Vertex<T>]),
    /// By column.
    Columns(&'a mut Columns<T>),
}

impl<T: Scalar> VertexStore<'_, T> {
    /// Returns the number of vertices.
    pub fn len(&self) -> usize {
        match self {
            Self::Vertices(vertices) => vertices.len(),
            Self::Columns(columns) => columns.len(),
        }
    }

    /// True if there are no vertices.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl<'a, T> From<&'a mut [Vertex<T>]> for VertexStore<'a, T> {
    fn from(vertices: &'a mut [Vertex<T>]) -> Self {
        Self::Vertices(vertices)
    }
}

impl<'a, T> From<&'a mut Columns<T>> for VertexStore<'a, T> {
    fn from(columns: &'a mut Columns<T>) -> Self {
        Self::Columns(columns)
    }
}

/// One color of one kind of constraint, or the part of it in one tile, with everything that its
/// projection needs.
pub struct ConstraintColor<'a, T: Scalar> {
    /// All constraints of the kind.
    pub set: &'a dyn ConstraintSet<T>,
    /// The color to project.
    pub color: usize,
    /// The tile to project, or `None` for the whole color.
    pub tile: Option<usize>,
    /// All vertices of the system.
    pub vertices: VertexStore<'a, T>,
    /// Parameters of the substep.
    pub step: Step<T>,
    /// One multiplier per constraint of the whole set, or empty if none are stored.
    pub multipliers: &'a mut [T],
}

impl<T: Scalar> ConstraintColor<'_, T> {
    /// Returns the constraints to project as a range of indices.
    pub fn range(&self) -> Range<usize> {
        match self.tile {
            Some(tile) => self.set.part(self.color, tile),
            None => self.set.range(self.color),
        }
    }

    /// Projects the constraints one after the other, in ascending order.
    pub fn project(self) {
        let range = self.range();
        let Self { set, vertices, step, multipliers, .. } = self;
        let multipliers = multipliers.get_mut(range.clone()).unwrap_or_default();
        set.project(ConstraintChunk { range, vertices, step, multipliers });
    }
}

/// One color of the vertices of a system, with everything that vertex block descent needs to move
/// them.
pub struct VertexColor<'a, T: Scalar> {
    pub(crate) system: &'a mut System<T>,
    /// The descent data of `system`.
    pub(crate) descent: &'a Descent<T>,
    pub(crate) pass: ColorPass,
}

impl<T: Scalar> VertexColor<'_, T> {
    /// Moves the vertices one after the other, in ascending order.
    pub fn descend(self) {
        let Self { system, descent, pass } = self;
        let System { vertices, previous, velocities, loads, kinds, .. } = system;
        for indices in descent.groups().order[pass.start..pass.end].chunks(1) {
            let mut forces = [VertexForce::none()];
            for (kind, incidence) in kinds.iter().zip(descent.incidences()) {
                kind.vertex_forces(VertexChunk {
                    incidence,
                    indices,
                    vertices: vertices.as_slice(),
                    forces: &mut forces,
                });
            }
            let i = indices[0] as usize;
            let load = load_of(loads, i);
            vertices[i] = descent.step().moved(vertices[i], &previous[i], &velocities[i], &forces[0], load);
        }
    }
}
