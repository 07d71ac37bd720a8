//! Access to vertices for the loops over constraints, exclusive or shared between threads.

use crate::Vertex;

/// Reads vertices.
pub trait Load<T> {
    /// Returns vertex `index`.
    fn load(&self, index: u32) -> Vertex<T>;
}

/// Reads and writes vertices.
pub trait Store<T>: Load<T> {
    /// Replaces vertex `index`.
    fn store(&mut self, index: u32, vertex: Vertex<T>);
}

/// Reads and writes vertices one behind the other.
pub trait Blocks<T>: Store<T> {
    /// Returns the numbers of `count` vertices, from vertex `first + offset` on.
    fn block(&self, first: u32, offset: usize, count: usize) -> &[T];
    /// Returns the numbers of `count` vertices, from vertex `first + offset` on, to replace them.
    fn block_mut(&mut self, first: u32, offset: usize, count: usize) -> &mut [T];
}

impl<T: Copy> Load<T> for &[Vertex<T>] {
    #[inline(always)]
    fn load(&self, index: u32) -> Vertex<T> {
        self[index as usize]
    }
}

impl<T: Copy> Load<T> for &mut [Vertex<T>] {
    #[inline(always)]
    fn load(&self, index: u32) -> Vertex<T> {
        self[index as usize]
    }
}

impl<T: Copy> Store<T> for &mut [Vertex<T>] {
    #[inline(always)]
    fn store(&mut self, index: u32, vertex: Vertex<T>) {
        self[index as usize] = vertex;
    }
}
