//! Adhesion of the two sides of a cut of no width.

use nalgebra::Point3;

use crate::lip_contact::{gap, params_at_rest};
use crate::{Constraint, Eval, LipContactMaterial, Real};

/// Two points that coincide at rest, one on each side of a cut, and that neither pass through each
/// other nor come off each other.
///
/// It is [`LipContact`](crate::LipContact) with its points, parameters and compliance, but it also
/// acts on sides that are apart:
///
/// ```text
/// C  = (p⁺ − p⁻)·n/L                       [1]
/// ∇C = (1 − t, t, −(1 − t), −t)·n/L        [1/m]
/// ```
///
/// The sides slide along each other without resistance. So wet tissue behaves where no air gets
/// between its layers.
#[derive(Clone, Copy, Debug)]
pub struct LipAdhesion;

impl Constraint<4> for LipAdhesion {
    const NAME: &'static str = "lip_adhesion";
    const WGSL: &'static str = cutis_shaders::constraints::LIP_ADHESION;
    type Params<T: Real> = [T; 4];
    type Material = LipContactMaterial;

    fn from_rest<T: Real>(x: &[Point3<T>; 4], material: &LipContactMaterial) -> [T; 4] {
        params_at_rest(x, material)
    }

    #[inline(always)]
    fn eval<T: Real>(x: &[Point3<T>; 4], params: &[T; 4]) -> Eval<T, 4> {
        let (gap, normal) = gap(x, params);
        let (first, second) = (normal * (T::one() - params[0]), normal * params[0]);
        Eval { c: gap, grad: [first, second, -first, -second] }
    }

    /// The value is already a share of the edge.
    fn rest_size<T: Real>(_: &[T; 4]) -> T {
        T::one()
    }
}
