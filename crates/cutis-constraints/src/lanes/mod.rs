//! SIMD lanes: several numbers in one vector register, and the choice of the register's width.
//!
//! A [`LaneTask`] is written once for any number of lanes. [`Scalar::in_lanes`] runs it with the
//! registers of a [`SimdLevel`]. Every lane has the bits of the scalar operations, so all levels
//! give the same result.

mod baseline;
mod level;
#[cfg(target_arch = "x86_64")]
mod mask;
#[cfg(target_arch = "x86_64")]
mod pack;
#[cfg(test)]
mod tests;
#[cfg(target_arch = "x86_64")]
mod x86;

use simba::simd::SimdValue;

use crate::{Real, Scalar};

pub use level::SimdLevel;
pub(crate) use level::{run_f32, run_f64};

/// A vector of lanes of `T`, with loads and stores for a solver.
pub trait Lanes<T: Scalar>: Real + SimdValue<Element = T> {
    /// Lanes that hold `value(0)`, `value(1)`, …
    fn from_lanes(value: impl FnMut(usize) -> T) -> Self;

    /// Lanes that hold the four numbers of `quad(0)`, then those of `quad(1)`, …
    fn from_quads(quad: impl Fn(usize) -> [T; 4]) -> Self;

    /// The inverse of [`from_quads`](Self::from_quads): calls `quad(n, numbers)` for each quad.
    fn quads(self, quad: impl FnMut(usize, [T; 4]));

    /// Lanes that hold the first numbers of `numbers`.
    ///
    /// # Panics
    /// Panics if there are fewer numbers than lanes.
    fn from_slice(numbers: &[T]) -> Self;

    /// The inverse of [`from_slice`](Self::from_slice): replaces the first numbers of `numbers`.
    ///
    /// # Panics
    /// Panics if there are fewer numbers than lanes.
    fn write_to(self, numbers: &mut [T]);

    /// Reads four numbers per lane: `row(lane)` gives those of one lane. Returns the first numbers
    /// of all lanes, the second ones, and so on.
    fn columns(row: impl Fn(usize) -> [T; 4]) -> [Self; 4];

    /// The inverse of [`columns`](Self::columns): calls `row(lane, numbers)` for each lane.
    fn rows(columns: [Self; 4], row: impl FnMut(usize, [T; 4]));
}

/// Work that is written once for any number of lanes.
///
/// Mark `run` and everything that it calls with `#[inline(always)]`. A call of a function that is
/// not inlined keeps lanes in memory, and is slow.
pub trait LaneTask<T: Scalar> {
    /// Does the work with lanes of the type `L`.
    fn run<L: Lanes<T>>(self);
}
