//! The skin strip for a body that is at rest in the scan: the resistance to a turn of its tension.

use nalgebra::{Point3, Vector3};

use crate::strip::{Rest, gradients, image, inverse_or_zero, length};
use crate::{Constraint, Eval, Real, SkinStripMaterial};

/// A constraint that resists a turn of a [`SkinStrip`](crate::SkinStrip) away from the constant
/// load that holds it in the scan.
///
/// It is the second part of the energy `Ũ` of [`SkinStripAtRest`](crate::SkinStripAtRest), which
/// must be used with it. The tension follows the present direction of the image `F`, and the load
/// keeps the direction of the image `F0` in the scan. With `F̂ = F/|F|` and `F̂0 = F0/|F0|`:
///
/// ```text
/// η = |F| − F̂0·F
/// C = √(2 t0 η)                     [m]
/// ∇_iC = B_i t0 (F̂ − F̂0)/C          [1]
/// ```
///
/// `C` is 0 or more, and convex. One projection turns `F` back to the direction of `F0` and keeps
/// its length. Near the scan `η` and `F̂ − F̂0` are computed from `F − F0`, without cancellation.
/// They are exactly zero in the scan if the parameters come from `from_rest` in the same number
/// type. The gradient is zero where `C = 0` or `F = 0`.
///
/// The load has a fixed direction in space. The gradients sum to zero, but they have a torque: a
/// turned body is turned back. It holds for rotations of the skin by some tens of degrees.
///
/// The parameters are `[B1, B2, F0x, F0y, F0z, t0, Hx, Hy, Hz]`, in m except for the weights. The
/// compliance is that of [`SkinStrip`](crate::SkinStrip). Without tension `t0` is 0, and so is `C`.
/// The rest size is zero, so `SystemBuilder::add_from_rest` refuses this kind. Use
/// `SystemBuilder::add` with parameters from `from_rest`.
#[derive(Clone, Copy, Debug)]
pub struct SkinStripTurn;

impl Constraint<3> for SkinStripTurn {
    const NAME: &'static str = "skin_strip_turn";
    const WGSL: &'static str = cutis_shaders::constraints::SKIN_STRIP_TURN;
    type Params<T: Real> = [T; 9];
    type Material = SkinStripMaterial;

    fn from_rest<T: Real>(x: &[Point3<T>; 3], material: &SkinStripMaterial) -> [T; 9] {
        let Rest { b: [b1, b2], rise, image, stretch, .. } = Rest::of(x, material);
        [b1, b2, image.x, image.y, image.z, stretch, rise.x, rise.y, rise.z]
    }

    #[inline(always)]
    fn eval<T: Real>(
        x: &[Point3<T>; 3],
        &[b1, b2, scan_x, scan_y, scan_z, stretch, rise @ ..]: &[T; 9],
    ) -> Eval<T, 3> {
        let two = T::constant(2.0);
        let scan = Vector3::new(scan_x, scan_y, scan_z);
        let scan_length = length(&scan);
        let scan_direction = scan * inverse_or_zero(scan_length);
        let image = image(x, [b1, b2], rise.into());
        let length = length(&image);
        let inverse_length = inverse_or_zero(length);
        let along = scan_direction.dot(&image);

        // F and F − F0 have the same part across F0. A short F has lost its digits in F − F0.
        let near = (two * length).simd_gt(scan_length);
        let moved = (image - scan).zip_map(&image, |moved, whole| moved.select(near, whole));
        let across = moved - scan_direction * scan_direction.dot(&moved);
        let ahead = across.dot(&across) * inverse_or_zero(length + along);
        let eta = ahead.select(along.simd_gt(T::zero()), length - along);

        let c = (two * stretch * eta).simd_sqrt();
        let turned = (across - scan_direction * eta) * inverse_length;
        Eval { c, grad: gradients(turned * (stretch * inverse_or_zero(c)), [b1, b2]) }
    }

    /// Returns zero: like a spring of length zero, the constraint has no size in the scan. Vertex
    /// block descent then takes `|∇C|²/α` for the curvature across the gradient. It is the
    /// curvature across `F`, and a bound of the energy in every direction.
    fn rest_size<T: Real>(_: &[T; 9]) -> T {
        T::zero()
    }
}
