//! The skin strip for a body that is at rest in the scan: the resistance to a change of length.

use nalgebra::Point3;

use crate::skin_strip::params;
use crate::strip::{gradients, image, inverse_or_zero, inverse_reach_squared, length};
use crate::{Constraint, Eval, Real, SkinStripMaterial};

/// A constraint that resists a change of length of a [`SkinStrip`](crate::SkinStrip) that the body
/// holds in equilibrium in the scan.
///
/// In the scan the skin is under tension and the body does not move: other forces, such as the
/// pressure of the tissue, balance the strip's force there. Taken as a constant load, they turn the
/// energy `U(F)` of the strip into
///
/// ```text
/// Ũ(F) = U(F) − U(F0) − ∇U(F0)·(F − F0)  ≥ 0
/// ```
///
/// with the image `F0` in the scan. `Ũ` and its force are zero in the scan, so a solver holds the
/// scan exactly, with any number of iterations. A cut removes strips together with their loads.
///
/// `Ũ` is the sum of two energies, one for the length of `F` and one for its direction. This type
/// is the first, [`SkinStripTurn`](crate::SkinStripTurn) is the second. One constraint with the
/// whole `Ũ` would not come to rest: along `F` the energy is `L0/t0` times as stiff as across, but
/// a projection uses one stiffness, that of the present gradient, and overshoots along `F`. A test
/// shows this.
///
/// With `e = |F| − L0`, `t0 = L0 − L` and `s = e + t0`:
///
/// ```text
/// Ĉ = e q,                        q = √(1 + β max(0, e)/(3 L0))         s ≥ 0   [m]
///     −√(κ s² + t0 (t0 − 2s))                                           s < 0
/// ∇_iĈ = B_i (1 + β max(0, e)/(2 L0))/q · F/|F|                         s ≥ 0   [1]
///        B_i (κ s − t0)/Ĉ · F/|F|                                       s < 0
/// ```
///
/// Where the strip is slack, `s < 0`, the load pushes with the constant force `t0/α`. `Ĉ` is
/// concave there, and the [reach](Constraint::inverse_reach_squared) keeps a projection from
/// passing the length in the scan.
///
/// The parameters `[B1, B2, L, L0, β, κ, Hx, Hy, Hz]` and the compliance are those of
/// [`SkinStrip`](crate::SkinStrip).
#[derive(Clone, Copy, Debug)]
pub struct SkinStripAtRest;

impl Constraint<3> for SkinStripAtRest {
    const NAME: &'static str = "skin_strip_at_rest";
    const WGSL: &'static str = cutis_shaders::constraints::SKIN_STRIP_AT_REST;
    type Params<T: Real> = [T; 9];
    type Material = SkinStripMaterial;

    fn from_rest<T: Real>(x: &[Point3<T>; 3], material: &SkinStripMaterial) -> [T; 9] {
        params(x, material)
    }

    #[inline(always)]
    fn eval<T: Real>(
        x: &[Point3<T>; 3],
        &[b1, b2, rest_length, scan_length, stiffening, compression, rise @ ..]: &[T; 9],
    ) -> Eval<T, 3> {
        let (zero, one) = (T::zero(), T::one());
        let image = image(x, [b1, b2], rise.into());
        let length = length(&image);
        let s = length - rest_length;
        let e = length - scan_length;
        let t0 = scan_length - rest_length;
        let slack = s.simd_lt(zero);
        let growth = stiffening * inverse_or_zero(scan_length) * e.simd_max(zero);
        let q =
            slack_square(s, t0, compression).select(slack, one + T::constant(1.0 / 3.0) * growth).simd_sqrt();
        let slope = (t0 - compression * s).select(slack, one + T::constant(0.5) * growth);
        let slope = slope * inverse_or_zero(q);
        let grad = gradients(image * (inverse_or_zero(length) * slope), [b1, b2]);
        Eval { c: q * (-one).select(slack, e), grad }
    }

    /// Returns the limit of all strips, and a stricter one for a slack strip. A projection of a
    /// slack strip with `κ < 1` would pass the length in the scan, because the tangent of `Ĉ` meets
    /// zero at a distance `Ĉ²/(t0 − κs)` from the present length, and the length in the scan is
    /// only `p = t0 − s` away. `1/r² = 2(t0 − κs)/(p Ĉ²)` limits the change of `|F|` to `p` for any
    /// masses, because `Σ B_i² ≤ 2`.
    #[inline(always)]
    fn inverse_reach_squared<T: Real>(
        x: &[Point3<T>; 3],
        &[b1, b2, rest_length, scan_length, _, compression, rise @ ..]: &[T; 9],
    ) -> Option<T> {
        let zero = T::zero();
        let length = length(&image(x, [b1, b2], rise.into()));
        let s = length - rest_length;
        let t0 = scan_length - rest_length;
        let beyond = (t0 - s) * slack_square(s, t0, compression);
        let limit = T::constant(2.0) * (t0 - compression * s) * inverse_or_zero(beyond);
        let passes = s.simd_lt(zero) & ((T::one() - compression) * t0).simd_gt(zero);
        Some(limit.select(passes, zero).simd_max(inverse_reach_squared(length, scan_length)))
    }

    fn rest_size<T: Real>(&[_, _, _, scan_length, ..]: &[T; 9]) -> T {
        scan_length
    }
}

/// Returns `Ĉ²` of a slack strip, in m².
#[inline(always)]
fn slack_square<T: Real>(s: T, t0: T, compression: T) -> T {
    compression * s * s + t0 * (t0 - T::constant(2.0) * s)
}
