//! The registers of AVX2 and AVX-512.
//!
//! Soundness: these functions run instructions that not every processor has. Only
//! [`SimdLevel`](super::SimdLevel) hands out the types of this file, after a check of the processor.
//! No function reads or writes through a pointer.
#![allow(unsafe_code)]

use std::arch::x86_64::*;
use std::mem::transmute;

use super::pack::Register;

/// Functions of a register that are one instruction each.
macro_rules! instructions {
    ($($name:ident($($operand:ident),*) = $instruction:ident;)*) => {
        $(#[inline(always)]
        fn $name(self $(, $operand: Self)*) -> Self {
            // SAFETY: the processor has the instruction (see the top of the file).
            unsafe { $instruction(self $(, $operand)*) }
        })*
    };
}

/// Comparisons of a register, which are false for a number that is not a number.
macro_rules! comparisons {
    ($instruction:ident, $mask:ty; $($name:ident = $operator:ident;)*) => {
        $(#[inline(always)]
        fn $name(self, other: Self) -> $mask {
            // SAFETY: the processor has the instruction (see the top of the file).
            unsafe { $instruction::<$operator>(self, other) }
        })*
    };
}

/// Functions of a register that are the same for every width but for the names of instructions.
macro_rules! common {
    ($array:ty, $splat:ident, $xor:ident, $and_not:ident, $low:ident, $high:ident, $shuffle:ident) => {
        #[inline(always)]
        fn from_array(array: $array) -> Self {
            // SAFETY: both types have the same size, and any bits are valid in both.
            unsafe { transmute(array) }
        }

        #[inline(always)]
        fn to_array(self) -> $array {
            // SAFETY: both types have the same size, and any bits are valid in both.
            unsafe { transmute(self) }
        }

        #[inline(always)]
        fn splat(value: f32) -> Self {
            // SAFETY: the processor has the instruction (see the top of the file).
            unsafe { $splat(value) }
        }

        #[inline(always)]
        fn neg(self) -> Self {
            // SAFETY: as above.
            unsafe { $xor(self, $splat(-0.0)) }
        }

        #[inline(always)]
        fn abs(self) -> Self {
            // SAFETY: as above.
            unsafe { $and_not($splat(-0.0), self) }
        }

        #[inline(always)]
        fn transposed([a, b, c, d]: [Self; 4]) -> [Self; 4] {
            // SAFETY: as above.
            unsafe {
                let (ab_low, ab_high) = ($low(a, b), $high(a, b));
                let (cd_low, cd_high) = ($low(c, d), $high(c, d));
                [
                    $shuffle::<0x44>(ab_low, cd_low),
                    $shuffle::<0xee>(ab_low, cd_low),
                    $shuffle::<0x44>(ab_high, cd_high),
                    $shuffle::<0xee>(ab_high, cd_high),
                ]
            }
        }
    };
}

/// Four numbers as a register.
#[inline(always)]
fn quad(numbers: [f32; 4]) -> __m128 {
    // SAFETY: both types have the same size, and any bits are valid in both.
    unsafe { transmute(numbers) }
}

impl Register for __m256 {
    const LANES: usize = 8;
    type Array = [f32; 8];
    type Mask = __m256;

    common!(
        [f32; 8],
        _mm256_set1_ps,
        _mm256_xor_ps,
        _mm256_andnot_ps,
        _mm256_unpacklo_ps,
        _mm256_unpackhi_ps,
        _mm256_shuffle_ps
    );

    instructions! {
        add(other) = _mm256_add_ps;
        sub(other) = _mm256_sub_ps;
        mul(other) = _mm256_mul_ps;
        div(other) = _mm256_div_ps;
        sqrt() = _mm256_sqrt_ps;
        larger(other) = _mm256_max_ps;
        smaller(other) = _mm256_min_ps;
    }

    comparisons! {
        _mm256_cmp_ps, __m256;
        equal = _CMP_EQ_OQ;
        greater = _CMP_GT_OQ;
        greater_or_equal = _CMP_GE_OQ;
        unordered = _CMP_UNORD_Q;
    }

    #[inline(always)]
    fn select(mask: __m256, this: Self, other: Self) -> Self {
        // SAFETY: the processor has the instruction (see the top of the file).
        unsafe { _mm256_blendv_ps(other, this, mask) }
    }

    #[inline(always)]
    fn bits(mask: __m256) -> u32 {
        // SAFETY: as above.
        unsafe { _mm256_movemask_ps(mask) as u32 }
    }

    #[inline(always)]
    fn mask(bits: u32) -> __m256 {
        // SAFETY: as above.
        unsafe {
            let bit = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let set = _mm256_and_si256(_mm256_set1_epi32(bits as i32), bit);
            _mm256_castsi256_ps(_mm256_cmpeq_epi32(set, bit))
        }
    }

    #[inline(always)]
    fn from_quads(numbers: impl Fn(usize) -> [f32; 4]) -> Self {
        // SAFETY: as above.
        unsafe {
            let low = _mm256_castps128_ps256(quad(numbers(0)));
            _mm256_insertf128_ps::<1>(low, quad(numbers(1)))
        }
    }
}

impl Register for __m512 {
    const LANES: usize = 16;
    type Array = [f32; 16];
    type Mask = __mmask16;

    common!(
        [f32; 16],
        _mm512_set1_ps,
        _mm512_xor_ps,
        _mm512_andnot_ps,
        _mm512_unpacklo_ps,
        _mm512_unpackhi_ps,
        _mm512_shuffle_ps
    );

    instructions! {
        add(other) = _mm512_add_ps;
        sub(other) = _mm512_sub_ps;
        mul(other) = _mm512_mul_ps;
        div(other) = _mm512_div_ps;
        sqrt() = _mm512_sqrt_ps;
        larger(other) = _mm512_max_ps;
        smaller(other) = _mm512_min_ps;
    }

    comparisons! {
        _mm512_cmp_ps_mask, __mmask16;
        equal = _CMP_EQ_OQ;
        greater = _CMP_GT_OQ;
        greater_or_equal = _CMP_GE_OQ;
        unordered = _CMP_UNORD_Q;
    }

    #[inline(always)]
    fn select(mask: __mmask16, this: Self, other: Self) -> Self {
        // SAFETY: the processor has the instruction (see the top of the file).
        unsafe { _mm512_mask_blend_ps(mask, other, this) }
    }

    #[inline(always)]
    fn bits(mask: __mmask16) -> u32 {
        u32::from(mask)
    }

    #[inline(always)]
    fn mask(bits: u32) -> __mmask16 {
        bits as __mmask16
    }

    #[inline(always)]
    fn from_quads(numbers: impl Fn(usize) -> [f32; 4]) -> Self {
        // SAFETY: as above.
        unsafe {
            let quads = _mm512_castps128_ps512(quad(numbers(0)));
            let quads = _mm512_insertf32x4::<1>(quads, quad(numbers(1)));
            let quads = _mm512_insertf32x4::<2>(quads, quad(numbers(2)));
            _mm512_insertf32x4::<3>(quads, quad(numbers(3)))
        }
    }
}
