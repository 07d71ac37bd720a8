//! Truth values of lanes. The unsafe methods are those of a trait, and do what their safe twins do.
#![allow(unsafe_code)]

use std::ops::{BitAnd, BitOr, BitXor, Not};

use simba::simd::{PrimitiveSimdValue, SimdBool, SimdValue};

use super::pack::Register;

/// One truth value per lane of a register.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub struct PackMask<R: Register>(pub R::Mask);

impl<R: Register> PrimitiveSimdValue for PackMask<R> {}

impl<R: Register> SimdValue for PackMask<R> {
    const LANES: usize = R::LANES;
    type Element = bool;
    type SimdBool = Self;

    #[inline(always)]
    fn splat(value: bool) -> Self {
        Self(R::mask(if value { u32::MAX } else { 0 }))
    }
    #[inline(always)]
    fn extract(&self, lane: usize) -> bool {
        R::bits(self.0) >> lane & 1 != 0
    }
    #[inline(always)]
    unsafe fn extract_unchecked(&self, lane: usize) -> bool {
        self.extract(lane)
    }
    #[inline(always)]
    fn replace(&mut self, lane: usize, value: bool) {
        *self = Self(R::mask(R::bits(self.0) & !(1 << lane) | u32::from(value) << lane));
    }
    #[inline(always)]
    unsafe fn replace_unchecked(&mut self, lane: usize, value: bool) {
        self.replace(lane, value);
    }
    #[inline(always)]
    fn select(self, mask: Self, other: Self) -> Self {
        self & mask | other & !mask
    }
}

impl<R: Register> Not for PackMask<R> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(R::mask(!R::bits(self.0)))
    }
}

macro_rules! mask_operator {
    ($operator:ident, $function:ident) => {
        impl<R: Register> $operator for PackMask<R> {
            type Output = Self;
            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                Self(R::mask(R::bits(self.0).$function(R::bits(other.0))))
            }
        }
    };
}
mask_operator!(BitAnd, bitand);
mask_operator!(BitOr, bitor);
mask_operator!(BitXor, bitxor);

impl<R: Register> PackMask<R> {
    /// The bits of all lanes.
    const ALL: u32 = u32::MAX >> (32 - R::LANES as u32);
}

impl<R: Register> SimdBool for PackMask<R> {
    #[inline(always)]
    fn bitmask(self) -> u64 {
        u64::from(R::bits(self.0) & Self::ALL)
    }
    #[inline(always)]
    fn and(self) -> bool {
        self.all()
    }
    #[inline(always)]
    fn or(self) -> bool {
        self.any()
    }
    #[inline(always)]
    fn xor(self) -> bool {
        self.bitmask().count_ones() % 2 == 1
    }
    #[inline(always)]
    fn all(self) -> bool {
        R::bits(self.0) & Self::ALL == Self::ALL
    }
    #[inline(always)]
    fn any(self) -> bool {
        R::bits(self.0) & Self::ALL != 0
    }
    #[inline(always)]
    fn none(self) -> bool {
        !self.any()
    }
    #[inline(always)]
    fn if_else<V: SimdValue<SimdBool = Self>>(self, a: impl FnOnce() -> V, b: impl FnOnce() -> V) -> V {
        a().select(self, b())
    }
    #[inline(always)]
    fn if_else2<V: SimdValue<SimdBool = Self>>(
        self,
        a: impl FnOnce() -> V,
        (second, b): (impl FnOnce() -> Self, impl FnOnce() -> V),
        c: impl FnOnce() -> V,
    ) -> V {
        a().select(self, b().select(second(), c()))
    }
    #[inline(always)]
    fn if_else3<V: SimdValue<SimdBool = Self>>(
        self,
        a: impl FnOnce() -> V,
        (second, b): (impl FnOnce() -> Self, impl FnOnce() -> V),
        (third, c): (impl FnOnce() -> Self, impl FnOnce() -> V),
        d: impl FnOnce() -> V,
    ) -> V {
        a().select(self, b().select(second(), c().select(third(), d())))
    }
}
