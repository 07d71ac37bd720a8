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
