//! Access to vertices for the loops over constraints, exclusive or shared between threads.

use cutis_constraints::{Lanes, Scalar};

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

/// Reads and writes a corner of as many constraints as there are lanes.
///
/// `PIECE` constraints, one after the other, have vertices that advance by two, see
/// [`Runs`](super::runs::Runs).
pub trait LaneAccess<T: Scalar>: Store<T> {
    /// Whether pieces of rows are read faster than other constraints.
    const READS_ROWS: bool;

    /// Returns x, y, z and the inverse mass of vertex `corner` of each constraint.
    fn read<L: Lanes<T>, const N: usize, const PIECE: usize>(
        &self,
        tuples: &[[u32; N]],
        corner: usize,
    ) -> [L; 4];

    /// Replaces vertex `corner` of each constraint. The inverse masses are those that were read.
    fn write<L: Lanes<T>, const N: usize, const PIECE: usize>(
        &mut self,
        tuples: &[[u32; N]],
        corner: usize,
        numbers: [L; 4],
    );
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
