//! Dihedral bending: two triangles keep the angle between them.

use cutis_constraints::{Constraint, Eval, Real};
use nalgebra::{Point3, Vector3};

/// Sine of a triangle's angle at the first vertex, and of half the opening of a fold, in units of the machine epsilon, below
/// which a direction is rounding noise.
const NOISE: f64 = 8.0;

/// Two triangles keep the angle between them: `0 1 2` and `0 3 1`, hinged on the edge `0 1`.
///
/// With the unit normals `m1`, `m2`, which are equal where the hinge is flat, and the angle `θ` from one to the other about
/// the edge,
///
/// ```text
/// C  = 2 sin(θ/2) − 2 sin(θ₀/2)                   [1]
/// ∇C = cos(θ/2) ∇θ                                [1/m]
/// 2 cos(θ/2) = |m1 + m2|,  sin θ = (m1 × m2)·ê,  2 sin(θ/2) = 2 sin θ / |m1 + m2|
/// ∇2θ = −|e| n1/|n1|²,  ∇3θ = −|e| n2/|n2|²
/// ∇1θ = −(s2 ∇2θ + s3 ∇3θ),  ∇0θ = −((1 − s2) ∇2θ + (1 − s3) ∇3θ)
/// ```
///
/// where `n` are the normals not made unit, `e` is the edge, and `s` is the place along it of the foot of the opposite vertex, from 0
/// to 1. `C` grows with `θ` all the way from −π to π, and equals `θ − θ₀` for small angles, so that `½C²/α` is the energy of
/// a hinge of stiffness `1/α` in N·m. No inverse trigonometric function is called: devices compute those differently.
///
/// Parameters `[2 sin(θ₀/2)]`. The gradient is zero where a triangle has no area, and `2 sin(θ/2)` counts as 0 there and where the
/// hinge is folded shut. The gradient of `θ` is that of Bridson, Marino and Fedkiw, *Simulation of Clothing with Folds and
/// Wrinkles*, SCA 2003.
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

    /// The angle has no unit: 1.
    fn rest_size<T: Real>(_: &[T; 1]) -> T {
        T::one()
    }
}

#[cfg(test)]
cutis_conformance::conformance!(DihedralBending, 4);
