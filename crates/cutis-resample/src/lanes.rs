//! Arithmetic that vectorizes: rounding without branches and without conversions that saturate.
//!
//! Compilers vectorize loops over many elements best, and so loops here and in the users of this
//! file run over arrays of many tets, rows or voxels. Everything between such a loop and the start
//! of a task is `#[inline(always)]`, because only inlined code may use registers that not every
//! processor has.

/// 1.5 · 2⁵². A sum with it has no bits behind the binary point, for numbers up to 2⁵¹ in size.
const INTEGERS: f64 = (3_u64 << 51) as f64;

/// 1 if a condition holds, else 0, without a branch.
#[inline(always)]
fn one_if(condition: bool) -> f64 {
    f64::from_bits(u64::from(condition).wrapping_neg() & 1.0_f64.to_bits())
}

/// The largest integer up to `x`, for up to 2⁵¹ in size.
#[inline(always)]
pub fn floor(x: f64) -> f64 {
    let near = (x + INTEGERS) - INTEGERS;
    near - one_if(near > x)
}

/// The smallest integer from `x` on, for up to 2⁵¹ in size.
#[inline(always)]
pub fn ceil(x: f64) -> f64 {
    let near = (x + INTEGERS) - INTEGERS;
    near + one_if(near < x)
}

/// An integer from 0 to below 2⁵¹ as such. Other numbers give other bits.
#[inline(always)]
pub fn integer(x: f64) -> u64 {
    (x + INTEGERS).to_bits() & ((1 << 51) - 1)
}

/// The smaller number. It does not handle NaN, which takes [`f64::min`] three more instructions.
#[inline(always)]
pub fn less(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The larger number, without handling NaN.
#[inline(always)]
pub fn more(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_is_that_of_the_standard_library() {
        for x in [0.0, 0.3, 0.5, 0.7, 1.0, 1.5, 2.5, 2.4999999999999996, 7e8 + 0.125, 2147483646.5] {
            assert_eq!((floor(x), ceil(x)), (x.floor(), x.ceil()), "{x}");
            assert_eq!((floor(-x), ceil(-x)), ((-x).floor(), (-x).ceil()), "-{x}");
            assert_eq!(integer(floor(x)), x as u64, "{x}");
        }
    }
}
