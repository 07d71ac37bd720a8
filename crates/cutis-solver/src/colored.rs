//! The only unsafe code: several threads move the vertices of one color at the same time.
//!
//! Why that is sound. (1) A batch checks at build that each index is below the number of vertices, and
//! `Groups::verify` that no two constraints of one color share a vertex; its fields are private and never change.
//! (2) [`Colored`] borrows the vertices mutably for its whole life, so that nobody else reads or moves them.
//! (3) A chunk is a range of one color, taken from an atomic counter that only grows: each constraint is handed
//! out once. So two threads never touch the same vertex or the same multiplier.
//!
//! For groups of vertices the same holds. (1) A `Descent` and the system that it was made from lie in one
//! `Simulation`; its incidences are those of the system's kinds, and `Groups::verify_vertices` has checked that no two vertices of
//! a color are in one constraint, and that each is named once. (2) [`ColoredVertices`] borrows the system mutably for its
//! whole life. (3) A chunk is handed out once; who has it moves its vertices, and reads those that are in constraints with
//! them, which nobody moves meanwhile.
#![allow(unsafe_code)]

use std::marker::PhantomData;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use cutis_constraints::Scalar;
use nalgebra::{Point3, Vector3};

use crate::batch::{Load, Store};
use crate::{ColorPass, ConstraintSet, Descent, Kind, Step, System, Vertex, VertexForce};

/// Constraints that a thread takes at a time. Fixed; results do not depend on it.
const CHUNK: usize = 1024;

/// One color of one kind, shared between the threads that project it.
///
/// ```
/// # use cutis_solver::{Colored, Stiffness, Step, SystemBuilder};
/// # use cutis_constraints::Distance;
/// # use nalgebra::Point3;
/// # let positions = [Point3::new(0.0, 0.0, 0.0), Point3::new(1.1, 0.0, 0.0)];
/// # let spring = [[0, 1]];
/// # let groups = cutis_coloring::greedy(&spring, 2)?;
/// # let mut system = SystemBuilder::<f64>::new(&positions, &[0.0, 1.0])?
/// #     .add::<Distance, 2>(&spring, &[[1.0]], Stiffness::pbd(1.0), &groups)?.build();
/// let (vertices, kinds) = system.projection_parts();
/// let color = Colored::new(vertices, &*kinds[0], 0, Step::Pbd, &mut []);
/// std::thread::scope(|scope| {
///     for _ in 0..2 {
///         scope.spawn(|| while color.project_next_chunk() {});
///     }
/// });
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Colored<'a, T: Scalar> {
    set: &'a dyn ConstraintSet<T>,
    range: Range<usize>,
    step: Step<T>,
    next: AtomicUsize,
    vertices: *mut Vertex<T>,
    multipliers: *mut T,
    keeps_multipliers: bool,
    borrow: PhantomData<&'a mut [T]>,
}

// SAFETY: sharing a `Colored` only lets threads take distinct chunks (see the top of the file), which touch distinct
// vertices and multipliers; `T` is plain data that may be used from any thread.
unsafe impl<T: Scalar> Sync for Colored<'_, T> {}

impl<'a, T: Scalar> Colored<'a, T> {
    /// Prepares `color` of `set`. `multipliers` holds one number per constraint of the whole set, or none.
    ///
    /// # Panics
    /// If the set was built for more vertices than given, or `multipliers` has another length.
    pub fn new(
        vertices: &'a mut [Vertex<T>],
        set: &'a dyn ConstraintSet<T>,
        color: usize,
        step: Step<T>,
        multipliers: &'a mut [T],
    ) -> Self {
        assert!(set.vertex_count() <= vertices.len(), "the set names vertices that are not there");
        let keeps_multipliers = !multipliers.is_empty();
        assert!(
            !keeps_multipliers || multipliers.len() == set.len(),
            "one multiplier per constraint, or none"
        );
        Self {
            set,
            range: set.range(color),
            step,
            next: AtomicUsize::new(0),
            vertices: vertices.as_mut_ptr(),
            multipliers: multipliers.as_mut_ptr(),
            keeps_multipliers,
            borrow: PhantomData,
        }
    }

    /// Takes a chunk that nobody took yet and projects it; `false` when none is left.
    pub fn project_next_chunk(&self) -> bool {
        let taken = self.next.fetch_add(1, Ordering::Relaxed);
        let start = self.range.start + taken.saturating_mul(CHUNK).min(self.range.len());
        let end = self.range.end.min(start.saturating_add(CHUNK));
        if start >= end {
            return false;
        }
        let multipliers: &mut [T] = if self.keeps_multipliers {
            // SAFETY: start..end lies within the set, whose length the multipliers have; the counter hands it out
            // once, so that no other slice overlaps it.
            unsafe { std::slice::from_raw_parts_mut(self.multipliers.add(start), end - start) }
        } else {
            &mut []
        };
        let vertices = SharedVertices { vertices: self.vertices, borrow: PhantomData };
        self.set.project_shared(start..end, vertices, self.step, multipliers);
        true
    }

    /// Number of chunks, an upper bound of the threads that can help.
    pub fn chunks(&self) -> usize {
        self.range.len().div_ceil(CHUNK)
    }
}

/// Vertices that a thread takes at a time. Fixed; results do not depend on it.
const VERTEX_CHUNK: usize = 128;

/// One color of vertices, shared between the threads that move them.
pub struct ColoredVertices<'a, T: Scalar> {
    kinds: &'a [Kind<T>],
    descent: &'a Descent<T>,
    range: Range<usize>,
    next: AtomicUsize,
    previous: &'a [Point3<T>],
    velocities: &'a [Vector3<T>],
    vertices: *mut Vertex<T>,
    vertex_count: usize,
    borrow: PhantomData<&'a mut [T]>,
}

// SAFETY: sharing it only lets threads take distinct chunks, as above.
unsafe impl<T: Scalar> Sync for ColoredVertices<'_, T> {}

impl<'a, T: Scalar> ColoredVertices<'a, T> {
    /// Prepares a color of `descent`, which must be that of `system`.
    pub(crate) fn new(system: &'a mut System<T>, descent: &'a Descent<T>, pass: ColorPass) -> Self {
        let System { vertices, previous, velocities, kinds, .. } = system;
        Self {
            kinds,
            descent,
            range: pass.start..pass.end,
            next: AtomicUsize::new(0),
            previous,
            velocities,
            vertices: vertices.as_mut_ptr(),
            vertex_count: vertices.len(),
            borrow: PhantomData,
        }
    }

    /// Takes a chunk that nobody took yet and moves its vertices; `false` when none is left.
    pub fn move_next_chunk(&self) -> bool {
        let Some(chosen) = self.next_chunk() else { return false };
        let mut forces = [VertexForce::none(); VERTEX_CHUNK];
        let forces = &mut forces[..chosen.len()];
        let shared = || SharedVertices { vertices: self.vertices, borrow: PhantomData };
        for (kind, incidence) in self.kinds.iter().zip(self.descent.incidences()) {
            kind.pull_shared(incidence, chosen, shared(), forces);
        }
        let mut vertices = shared();
        for (&vertex, vertex_force) in chosen.iter().zip(forces) {
            vertices.store(vertex, self.moved(vertex, vertices.load(vertex), vertex_force));
        }
        true
    }

    /// Moves all vertices of the color one by one, in safe scalar code.
    pub fn move_one_by_one(self) {
        // SAFETY: `self` is consumed, so that no thread shares it any more, and was made from this exclusive borrow.
        let vertices = unsafe { std::slice::from_raw_parts_mut(self.vertices, self.vertex_count) };
        while let Some(chosen) = self.next_chunk() {
            for vertex in chosen {
                let mut vertex_force = VertexForce::none();
                let (chosen, forces) =
                    (std::slice::from_ref(vertex), std::slice::from_mut(&mut vertex_force));
                for (kind, incidence) in self.kinds.iter().zip(self.descent.incidences()) {
                    kind.vertex_force(incidence, chosen, vertices, forces);
                }
                vertices[*vertex as usize] = self.moved(*vertex, vertices[*vertex as usize], &vertex_force);
            }
        }
    }

    fn next_chunk(&self) -> Option<&'a [u32]> {
        let taken = self.next.fetch_add(1, Ordering::Relaxed);
        let start = self.range.start + taken.saturating_mul(VERTEX_CHUNK).min(self.range.len());
        let end = self.range.end.min(start.saturating_add(VERTEX_CHUNK));
        (start < end).then(|| &self.descent.groups().order[start..end])
    }

    fn moved(&self, index: u32, vertex: Vertex<T>, vertex_force: &VertexForce<T>) -> Vertex<T> {
        let i = index as usize;
        self.descent.step().moved(vertex, &self.previous[i], &self.velocities[i], vertex_force)
    }

    /// Number of chunks, an upper bound of the threads that can help.
    pub fn chunks(&self) -> usize {
        self.range.len().div_ceil(VERTEX_CHUNK)
    }
}

/// The vertices as one chunk sees them. Only a batch can read or write through it, with its own checked indices.
pub struct SharedVertices<'a, T> {
    vertices: *mut Vertex<T>,
    borrow: PhantomData<&'a mut Vertex<T>>,
}

impl<T: Copy> Load<T> for SharedVertices<'_, T> {
    #[inline(always)]
    fn load(&self, index: u32) -> Vertex<T> {
        // SAFETY: a batch only passes its own indices, all below the number of vertices, and no other thread moves
        // a vertex of the constraint in work (top of the file).
        unsafe { *self.vertices.add(index as usize) }
    }
}

impl<T: Copy> Store<T> for SharedVertices<'_, T> {
    #[inline(always)]
    fn store(&mut self, index: u32, vertex: Vertex<T>) {
        // SAFETY: as for `load`.
        unsafe { *self.vertices.add(index as usize) = vertex }
    }
}
