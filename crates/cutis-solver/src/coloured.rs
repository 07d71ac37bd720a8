//! The only unsafe code: several threads move the vertices of one colour at the same time.
//!
//! Why that is sound. (1) A batch checks at build that each index is below the number of vertices, and
//! `Groups::verify` that no two constraints of one colour share a vertex; its fields are private and never change.
//! (2) [`Coloured`] borrows the vertices mutably for its whole life, so that nobody else reads or moves them.
//! (3) A chunk is a range of one colour, taken from an atomic counter that only grows: each constraint is handed
//! out once. So two threads never touch the same vertex or the same multiplier.
#![allow(unsafe_code)]

use std::marker::PhantomData;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use cutis_constraints::Scalar;

use crate::batch::Store;
use crate::{ConstraintSet, Step, Vertex};

/// Constraints that a thread takes at a time. Fixed; results do not depend on it.
const CHUNK: usize = 1024;

/// One colour of one kind, shared between the threads that project it.
///
/// ```
/// # use cutis_solver::{Coloured, Stiffness, Step, SystemBuilder};
/// # use cutis_constraints::Distance;
/// # use nalgebra::Point3;
/// # let positions = [Point3::new(0.0, 0.0, 0.0), Point3::new(1.1, 0.0, 0.0)];
/// # let spring = [[0, 1]];
/// # let groups = cutis_coloring::greedy(&spring, 2)?;
/// # let mut system = SystemBuilder::<f64>::new(&positions, &[0.0, 1.0])?
/// #     .add::<Distance, 2>(&spring, &[[1.0]], Stiffness::pbd(1.0), &groups)?.build();
/// let (vertices, kinds) = system.projection_parts();
/// let color = Coloured::new(vertices, &*kinds[0], 0, Step::Pbd, &mut []);
/// std::thread::scope(|scope| {
///     for _ in 0..2 {
///         scope.spawn(|| while color.project_next_chunk() {});
///     }
/// });
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Coloured<'a, T: Scalar> {
    set: &'a dyn ConstraintSet<T>,
    range: Range<usize>,
    step: Step<T>,
    next: AtomicUsize,
    vertices: *mut Vertex<T>,
    multipliers: *mut T,
    keeps_multipliers: bool,
    borrow: PhantomData<&'a mut [T]>,
}

// SAFETY: sharing a `Coloured` only lets threads take distinct chunks (see the top of the file), which touch distinct
// vertices and multipliers; `T` is plain data that may be used from any thread.
unsafe impl<T: Scalar> Sync for Coloured<'_, T> {}

impl<'a, T: Scalar> Coloured<'a, T> {
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

/// The vertices as one chunk sees them. Only a batch can read or write through it, with its own checked indices.
pub struct SharedVertices<'a, T> {
    vertices: *mut Vertex<T>,
    borrow: PhantomData<&'a mut Vertex<T>>,
}

impl<T: Copy> Store<T> for SharedVertices<'_, T> {
    #[inline(always)]
    fn load(&self, index: u32) -> Vertex<T> {
        // SAFETY: a batch only passes its own indices, all below the number of vertices, and no other thread moves
        // a vertex of the constraint in work (top of the file).
        unsafe { *self.vertices.add(index as usize) }
    }

    #[inline(always)]
    fn store(&mut self, index: u32, vertex: Vertex<T>) {
        // SAFETY: as for `load`.
        unsafe { *self.vertices.add(index as usize) = vertex }
    }
}
