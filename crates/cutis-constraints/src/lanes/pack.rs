//! Lanes of `f32` in one vector register, with the traits of a number.
//!
//! A [`Register`] knows the operations of an instruction set. Everything else is the same for all
//! of them and is written once here. Operations that constraints rarely use run lane by lane. The
//! unsafe methods are those of a trait, and do what their safe twins do.
#![allow(unsafe_code)]

use std::fmt::{self, Debug};
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Rem, RemAssign, Sub, SubAssign};

use nalgebra::{ComplexField, Field, RealField, SimdComplexField, SimdRealField};
use num_traits::{Num, One, Zero};
use simba::scalar::SubsetOf;
use simba::simd::{PrimitiveSimdValue, SimdBool, SimdPartialOrd, SimdSigned, SimdValue};

use super::Lanes;
use super::mask::PackMask;

/// A vector register of `f32`, and the operations on it.
///
/// The operations have the bits of the scalar operations, lane by lane.
pub trait Register: Copy + Send + Sync + 'static {
    /// Number of lanes.
    const LANES: usize;
    /// As many numbers as there are lanes.
    type Array: Copy + AsRef<[f32]> + AsMut<[f32]> + Send + Sync;
    /// One truth value per lane.
    type Mask: Copy + Send + Sync + 'static;
    fn splat(value: f32) -> Self;
    fn from_array(array: Self::Array) -> Self;
    fn to_array(self) -> Self::Array;
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    fn div(self, other: Self) -> Self;
    fn sqrt(self) -> Self;
    fn neg(self) -> Self;
    fn abs(self) -> Self;
    /// The instruction for the larger number. What it does with a NaN is its own affair.
    fn larger(self, other: Self) -> Self;
    /// The instruction for the smaller number.
    fn smaller(self, other: Self) -> Self;
    fn select(mask: Self::Mask, this: Self, other: Self) -> Self;
    fn equal(self, other: Self) -> Self::Mask;
    fn greater(self, other: Self) -> Self::Mask;
    fn greater_or_equal(self, other: Self) -> Self::Mask;
    /// True where one of both is not a number.
    fn unordered(self, other: Self) -> Self::Mask;
    /// Bit `n` is lane `n`.
    fn bits(mask: Self::Mask) -> u32;
    fn mask(bits: u32) -> Self::Mask;
    /// The numbers of `quad(0)`, then those of `quad(1)`, …
    fn from_quads(quad: impl Fn(usize) -> [f32; 4]) -> Self;
    /// Transposes the blocks of 4 × 4 numbers that four registers have at the same place.
    fn transposed(registers: [Self; 4]) -> [Self; 4];
}

/// A number with one value per lane of a register.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub struct Pack<R>(R);

impl<R: Register> Pack<R> {
    #[inline(always)]
    fn map(self, f: impl Fn(f32) -> f32) -> Self {
        let mut array = self.0.to_array();
        array.as_mut().iter_mut().for_each(|x| *x = f(*x));
        Self(R::from_array(array))
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        let (mut array, other) = (self.0.to_array(), other.0.to_array());
        array.as_mut().iter_mut().zip(other.as_ref()).for_each(|(x, &y)| *x = f(*x, y));
        Self(R::from_array(array))
    }

    #[inline(always)]
    fn fold(self, f: impl Fn(f32, f32) -> f32) -> f32 {
        self.0.to_array().as_ref().iter().copied().reduce(f).unwrap_or(0.0)
    }
}

impl<R: Register> Lanes<f32> for Pack<R> {
    #[inline(always)]
    fn from_lanes(mut value: impl FnMut(usize) -> f32) -> Self {
        let mut array = R::splat(0.0).to_array();
        array.as_mut().iter_mut().enumerate().for_each(|(lane, x)| *x = value(lane));
        Self(R::from_array(array))
    }

    #[inline(always)]
    fn from_quads(quad: impl Fn(usize) -> [f32; 4]) -> Self {
        Self(R::from_quads(quad))
    }

    #[inline(always)]
    fn quads(self, mut quad: impl FnMut(usize, [f32; 4])) {
        let numbers = self.0.to_array();
        for (n, numbers) in numbers.as_ref().as_chunks::<4>().0.iter().enumerate() {
            quad(n, *numbers);
        }
    }

    #[inline(always)]
    fn from_slice(numbers: &[f32]) -> Self {
        let mut array = R::splat(0.0).to_array();
        array.as_mut().copy_from_slice(&numbers[..R::LANES]);
        Self(R::from_array(array))
    }

    #[inline(always)]
    fn write_to(self, numbers: &mut [f32]) {
        numbers[..R::LANES].copy_from_slice(self.0.to_array().as_ref());
    }

    #[inline(always)]
    fn columns(row: impl Fn(usize) -> [f32; 4]) -> [Self; 4] {
        let [a, b, c, d] = R::transposed([
            every_fourth(&row, 0),
            every_fourth(&row, 1),
            every_fourth(&row, 2),
            every_fourth(&row, 3),
        ]);
        [Self(a), Self(b), Self(c), Self(d)]
    }

    #[inline(always)]
    fn rows(columns: [Self; 4], mut row: impl FnMut(usize, [f32; 4])) {
        for (n, rows) in R::transposed(columns.map(|column| column.0)).into_iter().enumerate() {
            let numbers = rows.to_array();
            for (place, quad) in numbers.as_ref().as_chunks::<4>().0.iter().enumerate() {
                row(4 * place + n, *quad);
            }
        }
    }
}

impl<R: Register> Debug for Pack<R> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.to_array().as_ref().fmt(out)
    }
}

/// The rows `n`, `n + 4`, … behind each other.
///
/// This is a function, because the compiler does not inline closures without fail, and only what is
/// inlined into a function for AVX2 or AVX-512 can inline their instructions.
#[inline(always)]
fn every_fourth<R: Register>(row: &impl Fn(usize) -> [f32; 4], n: usize) -> R {
    R::from_quads(|place| row(4 * place + n))
}

impl<R: Register> PartialEq for Pack<R> {
    #[inline(always)]
    fn eq(&self, other: &Self) -> bool {
        self.simd_eq(*other).all()
    }
}

impl<R: Register> PrimitiveSimdValue for Pack<R> {}

impl<R: Register> SimdValue for Pack<R> {
    const LANES: usize = R::LANES;
    type Element = f32;
    type SimdBool = PackMask<R>;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self(R::splat(value))
    }
    #[inline(always)]
    fn extract(&self, lane: usize) -> f32 {
        self.0.to_array().as_ref()[lane]
    }
    #[inline(always)]
    unsafe fn extract_unchecked(&self, lane: usize) -> f32 {
        self.extract(lane)
    }
    #[inline(always)]
    fn replace(&mut self, lane: usize, value: f32) {
        let mut array = self.0.to_array();
        array.as_mut()[lane] = value;
        *self = Self(R::from_array(array));
    }
    #[inline(always)]
    unsafe fn replace_unchecked(&mut self, lane: usize, value: f32) {
        self.replace(lane, value);
    }
    #[inline(always)]
    fn select(self, mask: PackMask<R>, other: Self) -> Self {
        Self(R::select(mask.0, self.0, other.0))
    }
}

macro_rules! operator {
    ($operator:ident, $function:ident, $assign:ident, $assign_function:ident) => {
        impl<R: Register> $operator for Pack<R> {
            type Output = Self;
            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                Self(self.0.$function(other.0))
            }
        }
        impl<R: Register> $assign for Pack<R> {
            #[inline(always)]
            fn $assign_function(&mut self, other: Self) {
                *self = Self(self.0.$function(other.0));
            }
        }
    };
}
operator!(Add, add, AddAssign, add_assign);
operator!(Sub, sub, SubAssign, sub_assign);
operator!(Mul, mul, MulAssign, mul_assign);
operator!(Div, div, DivAssign, div_assign);

impl<R: Register> Rem for Pack<R> {
    type Output = Self;
    #[inline(always)]
    fn rem(self, other: Self) -> Self {
        self.zip(other, |x, y| x % y)
    }
}

impl<R: Register> RemAssign for Pack<R> {
    #[inline(always)]
    fn rem_assign(&mut self, other: Self) {
        *self = *self % other;
    }
}

impl<R: Register> Neg for Pack<R> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.neg())
    }
}

impl<R: Register> Zero for Pack<R> {
    #[inline(always)]
    fn zero() -> Self {
        Self::splat(0.0)
    }
    #[inline(always)]
    fn is_zero(&self) -> bool {
        *self == Self::zero()
    }
}

impl<R: Register> One for Pack<R> {
    #[inline(always)]
    fn one() -> Self {
        Self::splat(1.0)
    }
}

impl<R: Register> Num for Pack<R> {
    type FromStrRadixErr = <f32 as Num>::FromStrRadixErr;
    fn from_str_radix(text: &str, radix: u32) -> Result<Self, Self::FromStrRadixErr> {
        <f32 as Num>::from_str_radix(text, radix).map(Self::splat)
    }
}

impl<R: Register> SubsetOf<Self> for Pack<R> {
    #[inline(always)]
    fn to_superset(&self) -> Self {
        *self
    }
    #[inline(always)]
    fn from_superset_unchecked(element: &Self) -> Self {
        *element
    }
    #[inline(always)]
    fn is_in_subset(_: &Self) -> bool {
        true
    }
}

macro_rules! subset {
    ($number:ty) => {
        impl<R: Register> SubsetOf<Pack<R>> for $number {
            #[inline(always)]
            fn to_superset(&self) -> Pack<R> {
                Pack::splat(*self as f32)
            }
            #[inline(always)]
            fn from_superset_unchecked(element: &Pack<R>) -> Self {
                element.extract(0).into()
            }
            #[inline(always)]
            fn is_in_subset(element: &Pack<R>) -> bool {
                *element == Pack::splat(element.extract(0))
            }
        }
    };
}
subset!(f32);
subset!(f64);

impl<R: Register> SimdPartialOrd for Pack<R> {
    #[inline(always)]
    fn simd_gt(self, other: Self) -> PackMask<R> {
        PackMask(self.0.greater(other.0))
    }
    #[inline(always)]
    fn simd_lt(self, other: Self) -> PackMask<R> {
        PackMask(other.0.greater(self.0))
    }
    #[inline(always)]
    fn simd_ge(self, other: Self) -> PackMask<R> {
        PackMask(self.0.greater_or_equal(other.0))
    }
    #[inline(always)]
    fn simd_le(self, other: Self) -> PackMask<R> {
        PackMask(other.0.greater_or_equal(self.0))
    }
    #[inline(always)]
    fn simd_eq(self, other: Self) -> PackMask<R> {
        PackMask(self.0.equal(other.0))
    }
    #[inline(always)]
    fn simd_ne(self, other: Self) -> PackMask<R> {
        !self.simd_eq(other)
    }
    #[inline(always)]
    fn simd_max(self, other: Self) -> Self {
        // As `f32::max`: `self` if `other` is a NaN, and `other` if `self` is one.
        Self(R::select(other.0.unordered(other.0), self.0, self.0.larger(other.0)))
    }
    #[inline(always)]
    fn simd_min(self, other: Self) -> Self {
        Self(R::select(other.0.unordered(other.0), self.0, self.0.smaller(other.0)))
    }
    #[inline(always)]
    fn simd_clamp(self, min: Self, max: Self) -> Self {
        self.simd_min(max).simd_max(min)
    }
    #[inline(always)]
    fn simd_horizontal_min(self) -> f32 {
        self.fold(f32::min)
    }
    #[inline(always)]
    fn simd_horizontal_max(self) -> f32 {
        self.fold(f32::max)
    }
}

impl<R: Register> SimdSigned for Pack<R> {
    #[inline(always)]
    fn simd_abs(&self) -> Self {
        Self(self.0.abs())
    }
    #[inline(always)]
    fn simd_abs_sub(&self, other: &Self) -> Self {
        (*self - *other).simd_max(Self::zero())
    }
    #[inline(always)]
    fn simd_signum(&self) -> Self {
        self.map(f32::signum)
    }
    #[inline(always)]
    fn is_simd_positive(&self) -> PackMask<R> {
        self.simd_gt(Self::zero())
    }
    #[inline(always)]
    fn is_simd_negative(&self) -> PackMask<R> {
        self.simd_lt(Self::zero())
    }
}

impl<R: Register> Field for Pack<R> {}

/// Functions of the number type that run lane by lane.
macro_rules! lane_by_lane {
    ($type:ident; $($name:ident = $function:ident),*) => {
        $(#[inline(always)]
        fn $name(self) -> Self {
            self.map(<f32 as $type>::$function)
        })*
    };
}

/// Constants of the number type.
macro_rules! constants {
    ($($name:ident = $function:ident),*) => {
        $(#[inline(always)]
        fn $name() -> Self {
            Self::splat(<f32 as RealField>::$function())
        })*
    };
}

impl<R: Register> SimdRealField for Pack<R> {
    fn simd_atan2(self, other: Self) -> Self {
        self.zip(other, f32::atan2)
    }
    fn simd_copysign(self, sign: Self) -> Self {
        self.zip(sign, f32::copysign)
    }
    #[inline(always)]
    fn simd_default_epsilon() -> Self {
        Self::splat(f32::EPSILON)
    }
    constants!(
        simd_pi = pi,
        simd_two_pi = two_pi,
        simd_frac_pi_2 = frac_pi_2,
        simd_frac_pi_3 = frac_pi_3,
        simd_frac_pi_4 = frac_pi_4,
        simd_frac_pi_6 = frac_pi_6,
        simd_frac_pi_8 = frac_pi_8,
        simd_frac_1_pi = frac_1_pi,
        simd_frac_2_pi = frac_2_pi,
        simd_frac_2_sqrt_pi = frac_2_sqrt_pi,
        simd_e = e,
        simd_log2_e = log2_e,
        simd_log10_e = log10_e,
        simd_ln_2 = ln_2,
        simd_ln_10 = ln_10
    );
}

impl<R: Register> SimdComplexField for Pack<R> {
    type SimdRealField = Self;
    lane_by_lane!(ComplexField;
        simd_floor = floor, simd_ceil = ceil, simd_round = round, simd_trunc = trunc, simd_fract = fract,
        simd_signum = signum, simd_sin = sin, simd_cos = cos, simd_tan = tan, simd_asin = asin,
        simd_acos = acos, simd_atan = atan, simd_sinh = sinh, simd_cosh = cosh, simd_tanh = tanh,
        simd_asinh = asinh, simd_acosh = acosh, simd_atanh = atanh, simd_log2 = log2,
        simd_log10 = log10, simd_ln = ln, simd_ln_1p = ln_1p, simd_exp = exp, simd_exp2 = exp2,
        simd_exp_m1 = exp_m1, simd_cbrt = cbrt, simd_argument = argument);
    #[inline(always)]
    fn from_simd_real(real: Self) -> Self {
        real
    }
    #[inline(always)]
    fn simd_real(self) -> Self {
        self
    }
    #[inline(always)]
    fn simd_imaginary(self) -> Self {
        Self::zero()
    }
    #[inline(always)]
    fn simd_modulus(self) -> Self {
        Self(self.0.abs())
    }
    #[inline(always)]
    fn simd_modulus_squared(self) -> Self {
        self * self
    }
    #[inline(always)]
    fn simd_norm1(self) -> Self {
        Self(self.0.abs())
    }
    #[inline(always)]
    fn simd_abs(self) -> Self {
        Self(self.0.abs())
    }
    #[inline(always)]
    fn simd_scale(self, factor: Self) -> Self {
        self * factor
    }
    #[inline(always)]
    fn simd_unscale(self, factor: Self) -> Self {
        self / factor
    }
    #[inline(always)]
    fn simd_mul_add(self, a: Self, b: Self) -> Self {
        self.zip(a, |x, a| x * a) + b
    }
    #[inline(always)]
    fn simd_hypot(self, other: Self) -> Self {
        self.zip(other, f32::hypot)
    }
    #[inline(always)]
    fn simd_recip(self) -> Self {
        Self::one() / self
    }
    #[inline(always)]
    fn simd_conjugate(self) -> Self {
        self
    }
    #[inline(always)]
    fn simd_sqrt(self) -> Self {
        Self(self.0.sqrt())
    }
    fn simd_sin_cos(self) -> (Self, Self) {
        (self.simd_sin(), self.simd_cos())
    }
    fn simd_log(self, base: Self) -> Self {
        self.zip(base, f32::log)
    }
    fn simd_powi(self, n: i32) -> Self {
        self.map(|x| x.powi(n))
    }
    fn simd_powf(self, n: Self) -> Self {
        self.zip(n, f32::powf)
    }
    fn simd_powc(self, n: Self) -> Self {
        self.zip(n, f32::powf)
    }
    #[inline(always)]
    fn simd_horizontal_sum(self) -> f32 {
        self.fold(|a, b| a + b)
    }
    #[inline(always)]
    fn simd_horizontal_product(self) -> f32 {
        self.fold(|a, b| a * b)
    }
}
