//! The dihedral bending constraint: two triangles keep the angle between them.

use cutis_constraints::{Constraint, Eval, Real};
use nalgebra::{Point3, Vector3};

/// Threshold in units of the machine epsilon, below which a direction is rounding noise. It applies
/// to the sine of a triangle's angle at the first vertex and to half the opening of a fold.
const NOISE: f64 = 8.0;

/// A constraint that keeps the angle between the triangles `0 1 2` and `0 3 1`, which share the
/// edge `0 1`.
///
/// Let `m1` and `m2` be the unit normals, which are equal where the hinge is flat, and `θ` the
/// angle from one to the other about the edge. Then
///
/// ```text
/// C  = 2 sin(θ/2) − 2 sin(θ₀/2)                   [1]
/// ∇C = cos(θ/2) ∇θ                                [1/m]
/// 2 cos(θ/2) = |m1 + m2|,  sin θ = (m1 × m2)·ê,  2 sin(θ/2) = 2 sin θ / |m1 + m2|
/// ∇2θ = −|e| n1/|n1|²,  ∇3θ = −|e| n2/|n2|²
/// ∇1θ = −(s2 ∇2θ + s3 ∇3θ),  ∇0θ = −((1 − s2) ∇2θ + (1 − s3) ∇3θ)
/// ```
///
/// where `n` are the unnormalized normals and `e` is the edge. `s` is the position of the foot of
/// the opposite vertex along the edge, from 0 to 1. `C` increases with `θ` from −π to π, and equals
/// `θ − θ₀` for small angles. `½C²/α` is then the energy of a hinge of stiffness `1/α` in N·m. The
/// formula needs no inverse trigonometric function, because devices compute those differently.
///
/// The parameters are `[2 sin(θ₀/2)]`. The gradient is zero where a triangle has no area.
/// `2 sin(θ/2)` is 0 there, and also where the hinge is completely folded. Source of the gradient
/// of `θ`: Bridson, Marino and Fedkiw, *Simulation of Clothing with Folds and Wrinkles*, SCA 2003.
#[derive(Clone, Copy, Debug)]
pub struct DihedralBending;

/// `2 sin(θ/2)` and its gradients.
#[inline(always)]
fn bend_and_gradient<T: Real>([x0, x1, x2, x3]: &[Point3<T>; 4]) -> (T, [Vector3<T>; 4]) {
    let (e, d2, d3) = (x1 - x0, x2 - x0, x3 - x0);
    let (n1, n2) = (e.cross(&d2), d3.cross(&e));
    let (ee, n1n1, n2n2) = (e.dot(&e), n1.dot(&n1), n2.dot(&n2));
    let noise = T::constant(NOISE) * T::simd_default_epsilon();
    let noise_squared = noise * noise;
    let defined =
        n1n1.simd_gt(noise_squared * ee * d2.dot(&d2)) & n2n2.simd_gt(noise_squared * ee * d3.dot(&d3));
    let (zero, one) = (T::zero(), T::one());
    let m1 = n1 * (one / n1n1.simd_sqrt()).select(defined, zero);
    let m2 = n2 * (one / n2n2.simd_sqrt()).select(defined, zero);
    let sum = m1 + m2;
    let two_cosines = sum.dot(&sum).simd_sqrt();
    let length = ee.simd_sqrt();
    let sine = m1.cross(&m2).dot(&e) * (one / length).select(defined, zero);
    let bend = ((sine + sine) / two_cosines).select(two_cosines.simd_gt(noise), zero);
    let steepness = -(two_cosines * T::constant(0.5)) * length;
    let grad2 = n1 * (steepness / n1n1).select(defined, zero);
    let grad3 = n2 * (steepness / n2n2).select(defined, zero);
    let s2 = (d2.dot(&e) / ee).select(defined, zero);
    let s3 = (d3.dot(&e) / ee).select(defined, zero);
    let grad1 = -(grad2 * s2 + grad3 * s3);
    let grad0 = -(grad2 * (one - s2) + grad3 * (one - s3));
    (bend, [grad0, grad1, grad2, grad3])
}

impl Constraint<4> for DihedralBending {
    const NAME: &'static str = "dihedral_bending";
    const WGSL: &'static str = include_str!("dihedral_bending.wgsl");
    type Params<T: Real> = [T; 1];
    type Material = ();

    fn from_rest<T: Real>(x: &[Point3<T>; 4], _: &()) -> [T; 1] {
        [bend_and_gradient(x).0]
    }

    #[inline(always)]
    fn eval<T: Real>(x: &[Point3<T>; 4], &[rest]: &[T; 1]) -> Eval<T, 4> {
        let (bend, grad) = bend_and_gradient(x);
        Eval { c: bend - rest, grad }
    }

    /// 1, because the angle has no unit.
    fn rest_size<T: Real>(_: &[T; 1]) -> T {
        T::one()
    }
}

#[cfg(test)]
cutis_conformance::conformance!(DihedralBending, 4);
