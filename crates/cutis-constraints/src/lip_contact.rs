//! Contact of the two sides of a cut of no width.

use nalgebra::{Point3, Vector3};

use crate::{Constraint, Eval, Real};

/// Two points that coincide at rest, one on each side of a cut, and that do not pass through each
/// other.
///
/// A cut severs a lattice edge of length `L` at the part `t` of its length. On the positive side
/// the ends of the edge are `x1` and `x2`, and on the negative side they are `x3` and `x4`. At rest
/// `x1 = x3` and `x2 = x4`.
///
/// ```text
/// p⁺ = (1 − t)·x1 + t·x2,   p⁻ = (1 − t)·x3 + t·x4
/// C  = min((p⁺ − p⁻)·n, 0)/L                                          [1]
/// ∇C = (1 − t, t, −(1 − t), −t)·n/L   where C < 0, else 0             [1/m]
/// ```
///
/// `n` is the unit normal of the cut at rest, from the negative side to the positive one. `−C` is
/// the overlap of the sides as a share of the edge. An open cut has neither value nor gradient, and
/// at rest `C` is exactly zero. The parameters are `[t, n_x/L, n_y/L, n_z/L]`. The compliance is
/// [`lip_contact_compliance`](crate::lip_contact_compliance), in 1/J.
///
/// The normal keeps its direction in space. So the points slide along the cut without resistance,
/// and a wound whose lips have turned by more than 90° is not closed by its contact.
#[derive(Clone, Copy, Debug)]
pub struct LipContact;

/// The place and the direction of a [`LipContact`] or a [`LipAdhesion`](crate::LipAdhesion).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LipContactMaterial {
    /// Part of the edge before the cut, from 0 to 1.
    pub part: f64,
    /// Unit normal of the cut, from its negative to its positive side.
    pub normal: [f64; 3],
}

impl Constraint<4> for LipContact {
    const NAME: &'static str = "lip_contact";
    const WGSL: &'static str = cutis_shaders::constraints::LIP_CONTACT;
    type Params<T: Real> = [T; 4];
    type Material = LipContactMaterial;

    fn from_rest<T: Real>(x: &[Point3<T>; 4], material: &LipContactMaterial) -> [T; 4] {
        params_at_rest(x, material)
    }

    #[inline(always)]
    fn eval<T: Real>(x: &[Point3<T>; 4], params: &[T; 4]) -> Eval<T, 4> {
        let (gap, normal) = gap(x, params);
        let zero = T::zero();
        let overlaps = gap.simd_lt(zero);
        let normal = normal * T::one().select(overlaps, zero);
        let (first, second) = (normal * (T::one() - params[0]), normal * params[0]);
        Eval { c: gap.select(overlaps, zero), grad: [first, second, -first, -second] }
    }

    /// The value is already a share of the edge.
    fn rest_size<T: Real>(_: &[T; 4]) -> T {
        T::one()
    }
}

/// `[t, n_x/L, n_y/L, n_z/L]` of points at rest.
pub(crate) fn params_at_rest<T: Real>(x: &[Point3<T>; 4], material: &LipContactMaterial) -> [T; 4] {
    let edge = x[1] - x[0];
    let length = edge.dot(&edge).simd_sqrt();
    let [nx, ny, nz] = material.normal.map(|n| T::constant(n) / length);
    [T::constant(material.part), nx, ny, nz]
}

/// The gap `(p⁺ − p⁻)·n/L` between the sides, negative where they overlap, and `n/L`.
#[inline(always)]
pub(crate) fn gap<T: Real>(x: &[Point3<T>; 4], &[part, nx, ny, nz]: &[T; 4]) -> (T, Vector3<T>) {
    let normal = Vector3::new(nx, ny, nz);
    (((x[0] - x[2]) * (T::one() - part) + (x[1] - x[3]) * part).dot(&normal), normal)
}
