//! The vertices as seen by one of several threads.
//!
//! Soundness: only a batch, a team and a chunk of vertices access vertices through these types,
//! with indices below the number of vertices, and only vertices that no other thread accesses at
//! the same time. The top of `colored.rs` says why.
#![allow(unsafe_code)]

use std::marker::PhantomData;

use cutis_constraints::{Lanes, Scalar};

use crate::batch::{LaneAccess, Load, QUAD, ROW, Store};
use crate::columns::place;
use crate::{Columns, Vertex, VertexStore};

/// The vertices of a system, one after the other or by column.
pub enum SharedStore<'a, T> {
    /// One vertex after the other.
    Vertices(SharedVertices<'a, T>),
    /// By column.
    Columns(SharedColumns<'a, T>),
}

impl<T: Scalar> SharedStore<'_, T> {
    /// Returns a view that is valid as long as the borrow of `store`.
    pub(super) fn new(store: VertexStore<'_, T>) -> Self {
        match store {
            VertexStore::Vertices(vertices) => Self::Vertices(SharedVertices::new(vertices.as_mut_ptr())),
            VertexStore::Columns(columns) => Self::Columns(SharedColumns::new(columns)),
        }
    }
}

impl<T> Clone for SharedStore<'_, T> {
    fn clone(&self) -> Self {
        match self {
            Self::Vertices(vertices) => Self::Vertices(SharedVertices { ..*vertices }),
            Self::Columns(columns) => Self::Columns(SharedColumns { ..*columns }),
        }
    }
}

/// The vertices, one after the other.
pub struct SharedVertices<'a, T> {
    vertices: *mut Vertex<T>,
    borrow: PhantomData<&'a mut Vertex<T>>,
}

impl<T> SharedVertices<'_, T> {
    pub(super) fn new(vertices: *mut Vertex<T>) -> Self {
        Self { vertices, borrow: PhantomData }
    }
}

impl<T: Copy> Load<T> for SharedVertices<'_, T> {
    #[inline(always)]
    fn load(&self, index: u32) -> Vertex<T> {
        // SAFETY: the index is below the number of vertices, and no other thread moves this vertex
        // (see the top of the file).
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

impl<T: Scalar> LaneAccess<T> for SharedVertices<'_, T> {
    const READS_ROWS: bool = false;

    #[inline(always)]
    fn read<L: Lanes<T>, const N: usize, const PIECE: usize>(
        &self,
        tuples: &[[u32; N]],
        corner: usize,
    ) -> [L; 4] {
        L::columns(|lane| self.load(tuples[lane][corner]).components())
    }

    #[inline(always)]
    fn write<L: Lanes<T>, const N: usize, const PIECE: usize>(
        &mut self,
        tuples: &[[u32; N]],
        corner: usize,
        numbers: [L; 4],
    ) {
        L::rows(numbers, |lane, quad| self.store(tuples[lane][corner], Vertex::from_components(quad)));
    }
}

/// The vertices by column.
pub struct SharedColumns<'a, T> {
    numbers: *mut T,
    half: usize,
    borrow: PhantomData<&'a mut T>,
}

impl<'a, T: Scalar> SharedColumns<'a, T> {
    fn new(columns: &mut Columns<T>) -> Self {
        let (numbers, half) = columns.as_mut_ptr();
        Self { numbers, half, borrow: PhantomData }
    }
}

impl<T: Copy> SharedColumns<'_, T> {
    /// Numbers of vertex `index` and those behind it in `column`.
    #[inline(always)]
    fn numbers(&self, column: usize, index: u32) -> *mut T {
        // SAFETY: the index is below the number of vertices, so that its place is within a column,
        // and there are four columns of `2 · half` numbers.
        unsafe { self.numbers.add(2 * column * self.half + place(index, self.half)) }
    }
}

impl<T: Scalar> Load<T> for SharedColumns<'_, T> {
    #[inline(always)]
    fn load(&self, index: u32) -> Vertex<T> {
        // SAFETY: no other thread moves this vertex (see the top of the file).
        Vertex::from_components(std::array::from_fn(|column| unsafe { *self.numbers(column, index) }))
    }
}

impl<T: Scalar> Store<T> for SharedColumns<'_, T> {
    #[inline(always)]
    fn store(&mut self, index: u32, vertex: Vertex<T>) {
        for (column, number) in vertex.components().into_iter().enumerate() {
            // SAFETY: no other thread accesses this vertex (see the top of the file).
            unsafe { *self.numbers(column, index) = number }
        }
    }
}

impl<T: Scalar> LaneAccess<T> for SharedColumns<'_, T> {
    const READS_ROWS: bool = true;

    #[inline(always)]
    fn read<L: Lanes<T>, const N: usize, const PIECE: usize>(
        &self,
        tuples: &[[u32; N]],
        corner: usize,
    ) -> [L; 4] {
        let mut columns = [L::splat(T::zero()); 4];
        for (column, lanes) in columns.iter_mut().enumerate() {
            *lanes = match PIECE {
                ROW => {
                    let first = self.numbers(column, tuples[0][corner]);
                    // SAFETY: the vertices of a piece advance by two, so that those of the lanes
                    // are adjacent. No other thread moves them.
                    L::from_slice(unsafe { std::slice::from_raw_parts(first, L::LANES) })
                }
                QUAD => L::from_quads(|n| {
                    let first = self.numbers(column, tuples[QUAD * n][corner]).cast::<[T; QUAD]>();
                    // SAFETY: the four vertices of a piece are adjacent. No other thread moves
                    // them. An array has the alignment of its elements.
                    unsafe { *first }
                }),
                // SAFETY: no other thread moves these vertices.
                _ => L::from_lanes(|lane| unsafe { *self.numbers(column, tuples[lane][corner]) }),
            };
        }
        columns
    }

    #[inline(always)]
    fn write<L: Lanes<T>, const N: usize, const PIECE: usize>(
        &mut self,
        tuples: &[[u32; N]],
        corner: usize,
        numbers: [L; 4],
    ) {
        // A projection does not change masses.
        for (column, lanes) in numbers[..3].iter().enumerate() {
            match PIECE {
                ROW => {
                    let first = self.numbers(column, tuples[0][corner]);
                    // SAFETY: as in `read`. No other thread accesses these vertices.
                    lanes.write_to(unsafe { std::slice::from_raw_parts_mut(first, L::LANES) });
                }
                QUAD => lanes.quads(|n, quad| {
                    let first = self.numbers(column, tuples[QUAD * n][corner]).cast::<[T; QUAD]>();
                    // SAFETY: as in `read`. No other thread accesses these vertices.
                    unsafe { *first = quad }
                }),
                _ => {
                    for lane in 0..L::LANES {
                        // SAFETY: as in `read`. No other thread accesses these vertices.
                        unsafe { *self.numbers(column, tuples[lane][corner]) = lanes.extract(lane) }
                    }
                }
            }
        }
    }
}
