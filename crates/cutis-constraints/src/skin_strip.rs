//! The skin strip: tension along a direction of the true skin, on any staircase of triangles.

use nalgebra::Point3;

use crate::strip::{Rest, gradients, image, inverse_or_zero, inverse_reach_squared, length};
use crate::{Constraint, Eval, Real, SkinStripMaterial};

/// A constraint that pulls a triangle of skin together along one direction of the skin.
///
/// The skin of a lattice is a staircase, and its triangles are not parallel to the true skin. A
/// strip therefore acts on the triangle as it is seen along the smooth outward normal `n` of the
/// skin. Let `d` be the direction of the strip, `m = d × n`, and `A_p = ½ n·((x2 − x1) × (x3 −
/// x1))` the projected area in the scan. With
///
/// ```text
/// b1 = m·(x3 − x2)/(2A_p),  b2 = m·(x1 − x3)/(2A_p),  b3 = −b1 − b2     [1/m]
/// f(x) = Σ b_i x_i                                                     [1]
/// ```
///
/// `f` is the present image of `d`: in the scan its part in the skin is `d` itself. The strip
/// measures the length of `f`. It uses `ℓ = 1/max|b_i|` to get a length in meters:
///
/// ```text
/// B_i = ℓ b_i,  F = Σ B_i x_i,  L0 = |F| in the scan,  s = |F| − L,  e = max(0, |F| − L0)
/// Ĉ   = s q,    q = √(1 + β e³/(3 L0 s²))       s > 0                   [m]
///       s √κ                                    s ≤ 0
/// ∇_iĈ = B_i (1 + β e²/(2 L0 s))/q · F/|F|      s > 0                   [1]
/// ```
///
/// For `s > 0` the force is `(s + β e²/(2 L0))/α`, and its energy is `Ĉ²/(2α)`. `Ĉ` is convex
/// there, so a projection stops short of the rest length for any `β`. With `β = 0` and `κ = 1` the
/// strip is a distance constraint between two weighted points. The gradient is zero where `F = 0`.
///
/// With the [compliance](SkinStripMaterial::compliance) `α = ℓ²/(k A_p)` and the rest length
/// `L = L0 (1 − τ/k)`, the force on vertex `i` in the scan is `−τ A_p b_i f`. Its part in the skin
/// is `−τ A_p b_i d`, which is the force of a membrane with the tension `τ` along `d`. The
/// stiffness `k` ([`SkinStripLaw::stiffness_n_per_m`](crate::SkinStripLaw::stiffness_n_per_m))
/// gives the skin the modulus `T` along `d`. Neither depends on the slope of the triangle. Two
/// strips at right angles make an orthotropic skin.
///
/// The parameters are `[B1, B2, L, L0, β, κ]`. The stored `β` is that of the law times `g0²`
/// (at most [`STEEPEST`](SkinStripMaterial::STEEPEST)²), because a strain of the skin stretches the
/// image by the `g0²`-th part of it.
#[derive(Clone, Copy, Debug)]
pub struct SkinStrip;

/// Returns `[B1, B2, L, L0, β, κ]`.
pub(crate) fn params<T: Real>(x: &[Point3<T>; 3], material: &SkinStripMaterial) -> [T; 6] {
    let Rest { b: [b1, b2], length, stretch, stiffening, .. } = Rest::of(x, material);
    [b1, b2, length - stretch, length, stiffening, T::constant(material.law().compression)]
}

impl Constraint<3> for SkinStrip {
    const NAME: &'static str = "skin_strip";
    const WGSL: &'static str = cutis_shaders::constraints::SKIN_STRIP;
    type Params<T: Real> = [T; 6];
    type Material = SkinStripMaterial;

    fn from_rest<T: Real>(x: &[Point3<T>; 3], material: &SkinStripMaterial) -> [T; 6] {
        params(x, material)
    }

    #[inline(always)]
    fn eval<T: Real>(
        x: &[Point3<T>; 3],
        &[b1, b2, rest_length, scan_length, stiffening, compression]: &[T; 6],
    ) -> Eval<T, 3> {
        let (zero, one) = (T::zero(), T::one());
        let image = image(x, [b1, b2]);
        let length = length(&image);
        let s = length - rest_length;
        let e = (length - scan_length).simd_max(zero);
        let stretched = s.simd_gt(zero);
        let ratio = e * inverse_or_zero(s);
        let growth = stiffening * inverse_or_zero(scan_length) * e;
        let square = one + T::constant(1.0 / 3.0) * growth * ratio * ratio;
        let q = square.select(stretched, compression).simd_sqrt();
        let slope = (one + T::constant(0.5) * growth * ratio).select(stretched, compression);
        let slope = slope * inverse_or_zero(q);
        let grad = gradients(image * (inverse_or_zero(length) * slope), [b1, b2]);
        Eval { c: s * q, grad }
    }

    #[inline(always)]
    fn inverse_reach_squared<T: Real>(
        x: &[Point3<T>; 3],
        &[b1, b2, _, scan_length, ..]: &[T; 6],
    ) -> Option<T> {
        Some(inverse_reach_squared(length(&image(x, [b1, b2])), scan_length))
    }

    fn rest_size<T: Real>(&[_, _, rest_length, ..]: &[T; 6]) -> T {
        rest_length
    }
}
