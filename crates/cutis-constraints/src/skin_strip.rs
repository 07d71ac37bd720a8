//! The skin strip: tension along a direction of the true skin, on any staircase of triangles.

use nalgebra::Point3;

use crate::strip::{Rest, gradients, image, inverse_or_zero, inverse_reach_squared, length};
use crate::{Constraint, Eval, Real, SkinStripMaterial};

/// A constraint that pulls a triangle of skin together along one direction of the skin.
///
/// The skin of a lattice is a staircase, and its triangles are not parallel to the true skin. A
/// strip therefore acts on the triangle as it is seen along the smooth outward normal `n` of the
/// skin. Let `d` be the direction of the strip, `m = d × n`, `A_p = ½ n·((x2 − x1) × (x3 − x1))`
/// the projected area in the scan, and `X_i` the vertices in the scan. With
///
/// ```text
/// b1 = m·(x3 − x2)/(2A_p),  b2 = m·(x1 − x3)/(2A_p),  b3 = −b1 − b2     [1/m], from the scan
/// h    = Σ b_i X_i − d                                                 [1]
/// f(x) = Σ b_i x_i − h  =  d + Σ b_i (x_i − X_i)                       [1]
/// ```
///
/// `f` is the present image of `d`. `h` is the slope of the triangle along the strip. Without it
/// the image would be that of the sloped triangle, and neighbors of opposite slope could stretch
/// together without resistance, like the folds of a bellows. With it, the strip measures the strain
/// of the displacements over the true skin.
///
/// The strip measures the length of `f`. It uses `ℓ = 1/max|b_i|` to get a length in meters:
///
/// ```text
/// B_i = ℓ b_i,  H = ℓ h,  F = Σ B_i x_i − H,  L0 = |F| in the scan = ℓ
/// s = |F| − L,  e = max(0, |F| − L0)                                    [m]
/// Ĉ   = s q,    q = √(1 + β e³/(3 L0 s²))       s > 0                   [m]
///       s √κ                                    s ≤ 0
/// ∇_iĈ = B_i (1 + β e²/(2 L0 s))/q · F/|F|      s > 0                   [1]
/// ```
///
/// For `s > 0` the force is `(s + β e²/(2 L0))/α`, and its energy is `Ĉ²/(2α)`. `Ĉ` is convex
/// there, so a projection stops short of the rest length for any `β`. With `β = 0` and `κ = 1` the
/// strip is a distance constraint between two weighted points. The gradient is zero where `F = 0`.
///
/// With the [compliance](SkinStripMaterial::compliance) `α = ℓ²/(T A_p)` and the rest length
/// `L = L0 (1 − τ/T)`, the force on vertex `i` in the scan is `−τ A_p b_i d`. It is the force of a
/// membrane with the tension `τ` along `d`, and it lies in the skin. A strain along `d` changes the
/// tension by `T`. Neither depends on the slope of the triangle. Two strips at right angles make an
/// orthotropic skin.
///
/// A triangle that is seen from its edge, or from behind, joins the two levels of a step. It has
/// the same force, which does not depend on `A_p`. For the stiffness, `A_p` is at least
/// [`LEAST_FACING`](SkinStripMaterial::LEAST_FACING) times the area of the triangle: then `f` is
/// `d` plus the shift of one level over the other, and the strip holds them together.
///
/// `H` has a fixed direction in space. A triangle that is parallel to the skin has none, and its
/// strip turns freely. A sloped one that turns by the angle `θ` with the skin is strained by up to
/// `|h|θ`, with opposite signs on opposite slopes. The vertices of the staircase relax this by
/// shifting along the skin, by `θ` times their height above its mean.
///
/// The parameters are `[B1, B2, L, L0, β, κ, Hx, Hy, Hz]`.
#[derive(Clone, Copy, Debug)]
pub struct SkinStrip;

/// Returns `[B1, B2, L, L0, β, κ, Hx, Hy, Hz]`.
pub(crate) fn params<T: Real>(x: &[Point3<T>; 3], material: &SkinStripMaterial) -> [T; 9] {
    let Rest { b: [b1, b2], rise, length, stretch, .. } = Rest::of(x, material);
    let [stiffening, compression] = [material.law().stiffening, material.law().compression].map(T::constant);
    [b1, b2, length - stretch, length, stiffening, compression, rise.x, rise.y, rise.z]
}

impl Constraint<3> for SkinStrip {
    const NAME: &'static str = "skin_strip";
    const WGSL: &'static str = cutis_shaders::constraints::SKIN_STRIP;
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
        &[b1, b2, _, scan_length, _, _, rise @ ..]: &[T; 9],
    ) -> Option<T> {
        Some(inverse_reach_squared(length(&image(x, [b1, b2], rise.into())), scan_length))
    }

    fn rest_size<T: Real>(&[_, _, rest_length, ..]: &[T; 9]) -> T {
        rest_length
    }
}
