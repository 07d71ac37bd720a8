//! The only unsafe code of the project: several threads move the vertices of one color.
//!
//! Soundness for constraints: (1) A batch checks when it is built that each index is below the
//! number of vertices, and `Groups::verify` checks that no two constraints of one color share a
//! vertex. The fields of a batch are private and never change. (2) [`Colored`] borrows the vertices
//! mutably for its whole lifetime, so that no other code reads or moves them. (3) A chunk is a
//! range of one color, and an atomic counter that only grows hands out each chunk once. So two
//! threads never access the same vertex or the same multiplier.
//!
//! Soundness for vertices: (1) A `Descent` and the system that it was built from are owned by one
//! `Simulation`. Its incidences are those of the system's kinds. `Groups::verify_vertices` checks
//! that no two vertices of a color are in one constraint, and that each vertex occurs once.
//! (2) [`ColoredVertices`] borrows the system mutably for its whole lifetime. (3) Each chunk is
//! handed out once. The thread that takes it moves the vertices of the chunk and reads the vertices
//! that share a constraint with them. No other thread moves those meanwhile.
#![allow(unsafe_code)]

use std::marker::PhantomData;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use cutis_constraints::{Scalar, SimdLevel};
use nalgebra::{Point3, Vector3};

use crate::batch::{ConstraintChunk, Load, Store, VertexChunk};
use crate::loads::load_of;
use crate::runs::VERTEX_CHUNK;
use crate::{ConstraintColor, ConstraintSet, Descent, Kind, Step, System, Vertex, VertexColor, VertexForce};

/// Number of constraints of a chunk. Results do not depend on it. Under Miri chunks are small, so
/// that a tiny body has several.
const CHUNK: usize = if cfg!(miri) { 8 } else { 1024 };

/// One color of one kind, shared between the threads that project it.
///
/// ```
/// # use cutis_solver::{Colored, ConstraintColor, Stiffness, Step, SystemBuilder};
/// # use cutis_constraints::Distance;
/// # use nalgebra::Point3;
/// # let positions = [Point3::new(0.0, 0.0, 0.0), Point3::new(1.1, 0.0, 0.0)];
/// # let spring = [[0, 1]];
/// # let groups = cutis_coloring::greedy(&spring, 2)?;
/// # let mut system = SystemBuilder::<f64>::new(&positions, &[0.0, 1.0])?
/// #     .add::<Distance, 2>(&spring, &[[1.0]], Stiffness::pbd(1.0), &groups)?.build();
/// let (vertices, kinds) = system.projection_parts();
/// let (set, step) = (&*kinds[0], Step::Pbd);
/// let color = ConstraintColor { set, color: 0, vertices, step, multipliers: &mut [] };
/// let color = Colored::new(color, cutis_constraints::SimdLevel::best());
/// std::thread::scope(|scope| {
///     for _ in 0..2 {
///         scope.spawn(|| while color.project_next_chunk() {});
///     }
/// });
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Colored<'a, T: Scalar> {
    set: &'a dyn ConstraintSet<T>,
    level: SimdLevel,
    range: Range<usize>,
    step: Step<T>,
    next: AtomicUsize,
    vertices: *mut Vertex<T>,
    multipliers: *mut T,
    keeps_multipliers: bool,
    borrow: PhantomData<&'a mut [T]>,
}

// SAFETY: threads that share a `Colored` can only take distinct chunks, which access distinct
// vertices and multipliers (see the top of the file). `T` is plain data that any thread may use.
unsafe impl<T: Scalar> Sync for Colored<'_, T> {}

impl<'a, T: Scalar> Colored<'a, T> {
    /// Prepares a color for several threads, with the SIMD lanes of `level`.
    ///
    /// # Panics
    /// Panics if the set was built for more vertices than given, or if there are multipliers but
    /// not one per constraint of the set.
    pub fn new(color: ConstraintColor<'a, T>, level: SimdLevel) -> Self {
        let ConstraintColor { set, color, vertices, step, multipliers } = color;
        assert!(set.vertex_count() <= vertices.len(), "the set refers to vertices that do not exist");
        let keeps_multipliers = !multipliers.is_empty();
        assert!(
            !keeps_multipliers || multipliers.len() == set.len(),
            "expected one multiplier per constraint, or none"
        );
        Self {
            set,
            level,
            range: set.range(color),
            step,
            next: AtomicUsize::new(0),
            vertices: vertices.as_mut_ptr(),
            multipliers: multipliers.as_mut_ptr(),
            keeps_multipliers,
            borrow: PhantomData,
        }
    }

    /// Takes the next free chunk and projects it. Returns `false` if no chunk is left.
    pub fn project_next_chunk(&self) -> bool {
        let Some(range) = next_chunk(&self.next, &self.range, CHUNK) else { return false };
        let multipliers: &mut [T] = if self.keeps_multipliers {
            // SAFETY: the range lies within the set, and there is one multiplier per constraint of
            // the set. The counter hands the range out once, so that no other slice overlaps it.
            unsafe { std::slice::from_raw_parts_mut(self.multipliers.add(range.start), range.len()) }
        } else {
            &mut []
        };
        let vertices = SharedVertices { vertices: self.vertices, borrow: PhantomData };
        let chunk = ConstraintChunk { range, vertices, step: self.step, multipliers };
        self.set.project_shared(self.level, chunk);
        true
    }

    /// Returns the number of chunks, which is an upper bound of the threads that can help.
    pub fn chunks(&self) -> usize {
        self.range.len().div_ceil(CHUNK)
    }
}

/// One color of vertices, shared between the threads that move them.
pub struct ColoredVertices<'a, T: Scalar> {
    kinds: &'a [Kind<T>],
    level: SimdLevel,
    descent: &'a Descent<T>,
    range: Range<usize>,
    next: AtomicUsize,
    previous: &'a [Point3<T>],
    velocities: &'a [Vector3<T>],
    loads: &'a [Vector3<T>],
    vertices: *mut Vertex<T>,
    borrow: PhantomData<&'a mut [T]>,
}

// SAFETY: threads that share it can only take distinct chunks (see the top of the file).
unsafe impl<T: Scalar> Sync for ColoredVertices<'_, T> {}

impl<'a, T: Scalar> ColoredVertices<'a, T> {
    /// Prepares a color for several threads, with the SIMD lanes of `level`.
    pub fn new(color: VertexColor<'a, T>, level: SimdLevel) -> Self {
        let VertexColor { system, descent, pass } = color;
        let System { vertices, previous, velocities, loads, kinds, .. } = system;
        Self {
            kinds,
            level,
            descent,
            range: pass.start..pass.end,
            next: AtomicUsize::new(0),
            previous,
            velocities,
            loads,
            vertices: vertices.as_mut_ptr(),
            borrow: PhantomData,
        }
    }

    /// Takes the next free chunk and moves its vertices. Returns `false` if no chunk is left.
    pub fn move_next_chunk(&self) -> bool {
        let Some(range) = next_chunk(&self.next, &self.range, VERTEX_CHUNK) else { return false };
        let indices = &self.descent.groups().order[range];
        let mut forces = [VertexForce::none(); VERTEX_CHUNK];
        let forces = &mut forces[..indices.len()];
        let plan = self.descent.runs().plan(indices);
        let shared = || SharedVertices { vertices: self.vertices, borrow: PhantomData };
        for (kind, incidence) in self.kinds.iter().zip(self.descent.incidences()) {
            let chunk = VertexChunk { incidence, indices, vertices: shared(), forces };
            kind.vertex_forces_shared(self.level, &plan, chunk);
        }
        let mut vertices = shared();
        for (&index, force) in indices.iter().zip(forces) {
            let i = index as usize;
            let (previous, velocity) = (&self.previous[i], &self.velocities[i]);
            let (vertex, load) = (vertices.load(index), load_of(self.loads, i));
            vertices.store(index, self.descent.step().moved(vertex, previous, velocity, force, load));
        }
        true
    }

    /// Returns the number of chunks, which is an upper bound of the threads that can help.
    pub fn chunks(&self) -> usize {
        self.range.len().div_ceil(VERTEX_CHUNK)
    }
}

/// Takes the next `size` elements of `range`, or the rest of it. Each element is handed out once.
fn next_chunk(next: &AtomicUsize, range: &Range<usize>, size: usize) -> Option<Range<usize>> {
    let number = next.fetch_add(1, Ordering::Relaxed);
    let start = range.start + number.saturating_mul(size).min(range.len());
    let end = range.end.min(start.saturating_add(size));
    (start < end).then_some(start..end)
}

/// The vertices as seen by one chunk. Only a batch can access vertices through it, with indices
/// that the batch has checked.
pub struct SharedVertices<'a, T> {
    vertices: *mut Vertex<T>,
    borrow: PhantomData<&'a mut Vertex<T>>,
}

impl<T: Copy> Load<T> for SharedVertices<'_, T> {
    #[inline(always)]
    fn load(&self, index: u32) -> Vertex<T> {
        // SAFETY: a batch passes only its own indices, which are below the number of vertices. No
        // other thread moves a vertex of the constraint at hand (see the top of the file).
        unsafe { *self.vertices.add(index as usize) }
    }
}

impl<T: Copy> Store<T> for SharedVertices<'_, T> {
    #[inline(always)]
    fn store(&mut self, index: u32, vertex: Vertex<T>) {
        // SAFETY: the conditions of `load` hold. No other thread reads this vertex meanwhile.
        unsafe { *self.vertices.add(index as usize) = vertex }
    }
}

#[cfg(test)]
mod tests;
