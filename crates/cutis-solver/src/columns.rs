//! Vertices by column: the x of all vertices, then y, z and the inverse masses, and in each column
//! first the vertices of even index, then those of odd index.
//!
//! Constraints of one color share no vertex, so along a row of vertices every second vertex starts
//! one. By column their vertices are adjacent, and SIMD lanes read them without a shuffle. The
//! passes of a step keep the vertices in this form, and the first and the last pass convert them.

use cutis_constraints::Scalar;

use crate::batch::{Load, Store};
use crate::{System, Vertex};

/// Length of a column is twice an odd multiple of this, so that columns do not compete for the same
/// place of a cache.
const LINE: usize = 16;

/// Least number of constraints in rows for each other one. Columns make constraints in rows faster
/// and others slower, such as those of a skin. Measured on the demo with position-based dynamics,
/// where a lattice of 6 mm has 5 and loses 15 %, one of 4 mm has 9 and gains 6 %, and one of 2.4 mm
/// has 15 and gains 42 %.
const ROWS_PER_OTHER: usize = 8;

/// The vertices of a system by column.
#[derive(Clone, Debug)]
pub struct Columns<T> {
    count: usize,
    half: usize,
    numbers: Vec<T>,
}

/// Length of half a column of `count` vertices.
fn half(count: usize) -> usize {
    let lines = count.div_ceil(2).div_ceil(LINE);
    LINE * (lines + (lines + 1) % 2)
}

impl<T: Scalar> System<T> {
    /// Returns the memory in bytes that the vertices take by column, or 0 if too few constraints
    /// are in rows, so that columns would not make their projection faster.
    pub fn column_bytes(&self) -> usize {
        let all: usize = self.kinds.iter().map(|kind| kind.len()).sum();
        let in_rows: usize = self.kinds.iter().map(|kind| kind.constraints_in_rows()).sum();
        if in_rows > ROWS_PER_OTHER * (all - in_rows) {
            8 * half(self.vertices.len()) * size_of::<T>()
        } else {
            0
        }
    }
}

impl<T: Scalar> Columns<T> {
    /// Returns columns for `count` vertices at the origin with infinite mass.
    pub fn new(count: usize) -> Self {
        let half = half(count);
        Self { count, half, numbers: vec![T::zero(); 8 * half] }
    }

    /// Returns columns that hold `vertices`.
    pub fn of(vertices: &[Vertex<T>]) -> Self {
        let mut columns = Self::new(vertices.len());
        (0..).zip(vertices).for_each(|(index, vertex)| columns.set(index, *vertex));
        columns
    }

    /// Returns the number of vertices.
    pub fn len(&self) -> usize {
        self.count
    }

    /// True if there are no vertices.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Returns vertex `index`.
    ///
    /// # Panics
    /// Panics if there is no such vertex.
    pub fn get(&self, index: u32) -> Vertex<T> {
        assert!((index as usize) < self.count, "there is no vertex {index}");
        let place = place(index, self.half);
        Vertex::from_components(std::array::from_fn(|column| self.numbers[2 * column * self.half + place]))
    }

    /// Replaces vertex `index`.
    ///
    /// # Panics
    /// Panics if there is no such vertex.
    pub fn set(&mut self, index: u32, vertex: Vertex<T>) {
        assert!((index as usize) < self.count, "there is no vertex {index}");
        let place = place(index, self.half);
        for (column, number) in vertex.components().into_iter().enumerate() {
            self.numbers[2 * column * self.half + place] = number;
        }
    }

    /// Returns the first vertex with a coordinate that is not finite, from `first` to `end - 1`.
    pub(crate) fn first_not_finite(&self, first: usize, end: usize) -> Option<usize> {
        let finite = |numbers: &[T]| numbers.iter().fold(true, |all, number| all & number.is_finite());
        let part = |half: usize| half * self.half + first / 2..half * self.half + end.div_ceil(2);
        if (0..6).all(|half| finite(&self.numbers[part(half)])) {
            return None;
        }
        (first..end).find(|&index| !self.get(index as u32).is_finite())
    }

    /// Returns all vertices as a block.
    pub(crate) fn block(&mut self) -> ColumnBlock<'_, T> {
        let mut halves = self.numbers.chunks_exact_mut(self.half);
        ColumnBlock { halves: std::array::from_fn(|_| halves.next().unwrap_or_default()) }
    }

    /// Returns the first number, and the length of half a column.
    pub(crate) fn as_mut_ptr(&mut self) -> (*mut T, usize) {
        (self.numbers.as_mut_ptr(), self.half)
    }

    /// Returns the memory in bytes.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(self.numbers.as_slice())
    }
}

impl<T: Scalar> Load<T> for &mut Columns<T> {
    fn load(&self, index: u32) -> Vertex<T> {
        self.get(index)
    }
}

impl<T: Scalar> Store<T> for &mut Columns<T> {
    fn store(&mut self, index: u32, vertex: Vertex<T>) {
        self.set(index, vertex);
    }
}

/// Place of a vertex in a column, whose halves have the length `half`.
#[inline(always)]
pub(crate) fn place(index: u32, half: usize) -> usize {
    (index >> 1) as usize + (index & 1) as usize * half
}

/// A range of vertices that starts with an even index, by column.
pub struct ColumnBlock<'a, T> {
    /// x of the even vertices, x of the odd ones, and so on.
    halves: [&'a mut [T]; 8],
}

impl<'a, T: Scalar> ColumnBlock<'a, T> {
    /// Splits the block into the first `middle` vertices and the rest. `middle` is even.
    pub(crate) fn split_at(self, middle: usize) -> (Self, Self) {
        let mut later: [&'a mut [T]; 8] = Default::default();
        let mut later_halves = later.iter_mut();
        let halves = self.halves.map(|half| {
            let (first, second) = half.split_at_mut(middle / 2);
            if let Some(later) = later_halves.next() {
                *later = second;
            }
            first
        });
        (Self { halves }, Self { halves: later })
    }

    /// Calls `work(n, vertex)` for the first `count` vertices and stores what it returns.
    #[inline(always)]
    pub(crate) fn update(&mut self, count: usize, mut work: impl FnMut(usize, Vertex<T>) -> Vertex<T>) {
        let pairs = count.div_ceil(2);
        let [ax, bx, ay, by, az, bz, aw, bw] = &mut self.halves;
        let mut sides = [[ax, ay, az, aw], [bx, by, bz, bw]].map(|side| side.map(|half| &mut half[..pairs]));
        for pair in 0..pairs {
            // One call for both, so that the work is inlined.
            for (parity, side) in sides.iter_mut().enumerate() {
                let n = 2 * pair + parity;
                if n == count {
                    break;
                }
                let vertex = Vertex::from_components(std::array::from_fn(|column| side[column][pair]));
                for (column, number) in work(n, vertex).components().into_iter().enumerate() {
                    side[column][pair] = number;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    fn vertices(count: usize) -> Vec<Vertex<f64>> {
        let vertex = |n: usize| Vertex::new(Point3::new(n as f64, 0.5, -(n as f64)), (n % 3) as f64);
        (0..count).map(vertex).collect()
    }

    #[test]
    fn vertices_come_back_and_every_second_one_is_adjacent() {
        for count in [0, 1, 2, 3, 16, 31, 32, 33, 1000] {
            let vertices = vertices(count);
            let mut columns = Columns::of(&vertices);
            assert_eq!((columns.len(), columns.is_empty()), (count, count == 0));
            assert!((0..).zip(&vertices).all(|(n, vertex)| columns.get(n) == *vertex));
            let (_, half) = columns.as_mut_ptr();
            assert!(half * 2 >= count && half / LINE % 2 == 1, "{half}");
            assert!((0..count as u32).all(|n| place(n + 2, half) == place(n, half) + 1));
            let mut seen = Vec::new();
            columns.block().update(count, |n, vertex| {
                seen.push((n, vertex));
                Vertex::new(vertex.position() * 2.0, 7.0)
            });
            assert!(seen.into_iter().eq(vertices.iter().copied().enumerate()));
            let doubled = |vertex: &Vertex<f64>| Vertex::new(vertex.position() * 2.0, 7.0);
            assert!((0..).zip(&vertices).all(|(n, vertex)| columns.get(n) == doubled(vertex)));
        }
    }

    #[test]
    fn blocks_divide_the_vertices() {
        let vertices = vertices(21);
        let mut columns = Columns::of(&vertices);
        let (mut first, mut second) = columns.block().split_at(8);
        let mut seen = Vec::new();
        first.update(8, |_, vertex| {
            seen.push(vertex);
            vertex
        });
        second.update(13, |_, vertex| {
            seen.push(vertex);
            vertex
        });
        assert_eq!(seen, vertices);
    }

    #[test]
    fn the_first_vertex_that_is_not_finite_is_found() {
        let vertices = vertices(40);
        assert_eq!(Columns::of(&vertices).first_not_finite(0, 40), None);
        for (bad, axis) in [(0, 0), (7, 1), (18, 2), (39, 0)] {
            let mut columns = Columns::of(&vertices);
            for (vertex, value) in [(bad, f64::NAN), (39, f64::INFINITY)] {
                let mut position = vertices[vertex].position();
                position[axis] = value;
                columns.set(vertex as u32, Vertex::new(position, 1.0));
            }
            assert_eq!(columns.first_not_finite(0, 40), Some(bad));
            assert_eq!(columns.first_not_finite(8, 16), None);
        }
    }
}
