//! Where the loops over constraints read vertices and move them.

use crate::Vertex;

/// Where a loop over constraints reads vertices.
pub trait Load<T> {
    /// The vertex `index`.
    fn load(&self, index: u32) -> Vertex<T>;
}

/// Where it moves them, too.
pub trait Store<T>: Load<T> {
    /// Replaces the vertex `index`.
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
