//! The projection of one constraint. Every CPU backend runs this function.

use cutis_constraints::{Constraint, Real, UnitGradients};
use nalgebra::{Point3, Vector3, convert};
use simba::simd::SimdBool;

use crate::Step;

/// A formula for the multiplier of a constraint's gradients.
pub trait Rule<T: Real>: Copy + Send + Sync {
    /// Returns numerator and denominator of `Δλ` for the value `c`, the weighted square of the
    /// gradients `Σ w|∇C|²`, the stiffness of the constraint and its accumulated multiplier.
    fn fraction(self, c: T, weighted_square: T, stiffness: T, multiplier: T) -> (T, T);

    /// Returns `Δλ`. It is zero where the quotient is undefined or overflows.
    #[inline(always)]
    fn multiplier(self, c: T, weighted_square: T, stiffness: T, multiplier: T) -> T {
        let (numerator, denominator) = self.fraction(c, weighted_square, stiffness, multiplier);
        quotient_or_zero(numerator, denominator)
    }
}

/// The PBD formula `Δλ = −s·C / Σ w|∇C|²` (Müller et al. 2007, eqs. 8–9) with the stiffness `s`.
#[derive(Clone, Copy, Debug)]
pub struct Pbd;

/// The XPBD formula `Δλ = (−C − α̃λ) / (Σ w|∇C|² + α̃)` with `α̃ = α/h²` (Macklin et al. 2016,
/// eq. 18). The stiffness is the compliance `α`.
#[derive(Clone, Copy, Debug)]
pub struct Xpbd<T> {
    /// `1/h²` in 1/s².
    pub inverse_h_squared: T,
}

impl<T: Real> Rule<T> for Pbd {
    #[inline(always)]
    fn fraction(self, c: T, weighted_square: T, stiffness: T, _multiplier: T) -> (T, T) {
        (-(stiffness * c), weighted_square)
    }
}

impl<T: Real> Rule<T> for Xpbd<T> {
    #[inline(always)]
    fn fraction(self, c: T, weighted_square: T, stiffness: T, multiplier: T) -> (T, T) {
        let compliance = stiffness * self.inverse_h_squared;
        (-c - compliance * multiplier, weighted_square + compliance)
    }
}

/// Chooses the formula at run time, so that the loops over constraints are compiled once for both.
impl<T: Real> Rule<T> for Step<T> {
    #[inline(always)]
    fn fraction(self, c: T, weighted_square: T, stiffness: T, multiplier: T) -> (T, T) {
        match self {
            Self::Pbd => Pbd.fraction(c, weighted_square, stiffness, multiplier),
            Self::Xpbd { inverse_h_squared } => {
                Xpbd { inverse_h_squared }.fraction(c, weighted_square, stiffness, multiplier)
            }
        }
    }
}

/// Returns `numerator / denominator`, or zero where the denominator is zero or the quotient is not
/// finite. So a constraint whose vertices are fixed or whose gradient vanishes moves nothing.
#[inline(always)]
fn quotient_or_zero<T: Real>(numerator: T, denominator: T) -> T {
    let quotient = numerator / denominator;
    // The product is zero for a finite quotient and NaN for any other.
    let finite = (quotient * T::zero()).simd_eq(T::zero());
    quotient.select(finite, T::zero())
}

/// Returns the smallest `Σ w|∇C|²` for which no vertex moves farther than the reach `r`. It is
/// `w C²/r²`, where `w` is the inverse mass of the lightest vertex: for every `D ≥ Σ w|∇C|²` above
/// it, a vertex moves by `w_i|∇_iC||C|/D ≤ √w_i·|C|/√D ≤ r`.
#[inline(always)]
fn least_square<T: Real, const N: usize>(w: &[T; N], c: T, inverse_reach_squared: T) -> T {
    let lightest = w.iter().fold(convert(0.0), |most: T, &w| most.simd_max(w));
    lightest * (c * inverse_reach_squared * c)
}

/// Result of one projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection<T, const N: usize> {
    /// Correction of each position, in meters.
    pub corrections: [Vector3<T>; N],
    /// Change of the multiplier.
    pub multiplier: T,
}

/// Projects constraint `C` at the positions `x` with the inverse masses `w`.
///
/// This is a pure function, independent of indices, storage and threads. `T` may be a number or a
/// vector of SIMD lanes.
#[inline(always)]
pub fn project<C: Constraint<N>, const N: usize, T: Real, R: Rule<T>>(
    x: &[Point3<T>; N],
    w: &[T; N],
    params: &C::Params<T>,
    rule: R,
    stiffness: T,
    multiplier: T,
) -> Projection<T, N> {
    if let Some(UnitGradients { c, along, length }) = C::unit_gradients(x, params) {
        let mut weight = w[0];
        for i in 1..N {
            weight += w[i];
        }
        let (numerator, denominator) = rule.fraction(c, weight, stiffness, multiplier);
        // Δλ divided by the length of the vectors.
        let factor = quotient_or_zero(numerator, denominator * length);
        let corrections = std::array::from_fn(|i| along[i] * (w[i] * factor));
        return Projection { corrections, multiplier: factor * length };
    }
    let eval = C::eval(x, params);
    let mut weighted_square: T = convert(0.0);
    for i in 0..N {
        let part = w[i] * eval.grad[i].dot(&eval.grad[i]);
        weighted_square = if i == 0 { part } else { weighted_square + part };
    }
    if !C::is_in_reach(eval.c, params).all()
        && let Some(inverse_reach_squared) = C::inverse_reach_squared(x, params)
    {
        weighted_square = weighted_square.simd_max(least_square(w, eval.c, inverse_reach_squared));
    }
    let multiplier = rule.multiplier(eval.c, weighted_square, stiffness, multiplier);
    Projection { corrections: std::array::from_fn(|i| eval.grad[i] * (w[i] * multiplier)), multiplier }
}

#[cfg(test)]
mod tests {
    use cutis_constraints::{Eval, Volume};

    use super::*;

    /// A tetrahedron with three edges of the length `edge` at its first vertex and the volume
    /// `height·edge²/6`, in the constraint `Volume` or in one whose limit is always
    /// computed.
    fn both_ways(edge: f32, height: f32, rest_volume: f32, w: [f32; 4]) -> [Projection<f32, 4>; 2] {
        let x = [[0.0, 0.0, 0.0], [edge, 0.0, 0.0], [0.0, edge, 0.0], [0.0, 0.0, height]].map(Point3::from);
        let with = project::<Volume, 4, f32, _>(&x, &w, &[rest_volume], Pbd, 1.0, 0.0);
        [with, project::<AlwaysLimited, 4, f32, _>(&x, &w, &[rest_volume], Pbd, 1.0, 0.0)]
    }

    struct AlwaysLimited;

    impl Constraint<4> for AlwaysLimited {
        const NAME: &'static str = "always limited";
        const WGSL: &'static str = Volume::WGSL;
        type Params<T: Real> = [T; 1];
        type Material = ();
        fn from_rest<T: Real>(x: &[Point3<T>; 4], (): &()) -> [T; 1] {
            Volume::from_rest(x, &Default::default())
        }
        fn eval<T: Real>(x: &[Point3<T>; 4], params: &[T; 1]) -> Eval<T, 4> {
            Volume::eval(x, params)
        }
        fn inverse_reach_squared<T: Real>(x: &[Point3<T>; 4], params: &[T; 1]) -> Option<T> {
            Volume::inverse_reach_squared(x, params)
        }
        fn rest_size<T: Real>(params: &[T; 1]) -> T {
            Volume::rest_size(params)
        }
    }

    #[test]
    fn a_limit_that_does_not_act_changes_no_bit() {
        let mut cases = [0; 2];
        for scale in [1e-9f32, 1e-5, 1.0, 1e6, 1e12] {
            for flat in [0.0, 1e-12, 1e-6, 1e-3, 0.02, 0.1, 0.3, 1.0, 7.0] {
                for grown in [-1e3, 0.0, 0.2, 1.0, 1.5, 30.0, 1e4, 1e9] {
                    for light in [0.0, 1e-20, 1.0, 1e5, 1e25] {
                        let volume = scale * scale * scale * grown / 6.0;
                        let [with, without] = both_ways(scale, scale * flat, volume, [1.0, light, 2.0, 0.5]);
                        let same = |a: f32, b: f32| a == b || a.is_nan() && b.is_nan();
                        assert!(same(with.multiplier, without.multiplier), "{scale} {flat} {grown} {light}");
                        let x = [[0.0; 3], [scale, 0.0, 0.0], [0.0, scale, 0.0], [0.0, 0.0, scale * flat]];
                        let c = Volume::eval(&x.map(Point3::from), &[volume]).c;
                        let skipped = Volume::is_in_reach(c, &[volume]);
                        cases[usize::from(skipped)] += 1;
                    }
                }
            }
        }
        assert!(cases.into_iter().all(|count| count > 100), "{cases:?}");
    }

    #[test]
    fn an_undefined_quotient_moves_nothing() {
        let rule = Xpbd { inverse_h_squared: 1.0f32 };
        assert_eq!(rule.multiplier(1.0, 0.0, 0.0, 0.0), 0.0);
        assert_eq!(rule.multiplier(1e-3, 1e-45, 0.0, 0.0), 0.0, "overflow");
        assert_eq!(rule.multiplier(f32::NAN, 1.0, 0.0, 0.0), 0.0);
        assert_eq!(Pbd.multiplier(0.0, 0.0, 1.0f64, 0.0), 0.0);
        assert_eq!(Pbd.multiplier(2.0, 4.0, 0.5f64, 0.0), -0.25);
        assert_eq!(rule.multiplier(2.0, 1.0, 3.0, 0.0), -0.5);
    }
}
