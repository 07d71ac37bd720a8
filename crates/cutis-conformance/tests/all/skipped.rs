//! Checks that do not apply to a constraint are skipped with a reason.

use cutis_conformance::{Subject, Verdict, checks};
use cutis_constraints::{Constraint, Eval, Real};
use nalgebra::{Point3, Vector3};

use crate::wrong::{AbsoluteEpsilon, OneSided, Stretch};

/// Keeps a point on the plane `z = height`.
struct OnPlane;

impl Constraint<1> for OnPlane {
    const NAME: &'static str = "on plane";
    const WGSL: &'static str = "
        struct Params { height: f32 }
        fn eval(x: array<vec3f, N>, p: Params) -> Eval {
            return Eval(x[0].z - p.height, array<vec3f, N>(vec3f(0.0, 0.0, 1.0)));
        }";
    type Params<T: Real> = [T; 1];
    type Material = ();

    fn from_rest<T: Real>([point]: &[Point3<T>; 1], _: &()) -> [T; 1] {
        [point.z]
    }

    fn eval<T: Real>([point]: &[Point3<T>; 1], &[height]: &[T; 1]) -> Eval<T, 1> {
        Eval { c: point.z - height, grad: [Vector3::z()] }
    }

    fn rest_size<T: Real>(&[height]: &[T; 1]) -> T {
        height
    }
}

#[test]
fn an_anchored_constraint_is_not_checked_for_momentum() {
    let free = Subject::<OnPlane, 1>::new([()]);
    assert_eq!(checks::momentum(&free).verdict(), Verdict::Failed);
    let anchored = Subject::<OnPlane, 1>::new([()]).anchored();
    assert!(matches!(checks::momentum(&anchored).verdict(), Verdict::Skipped(_)));
}

/// Keeps an edge parallel to the z axis. It has a torque.
struct Upright;

impl Constraint<2> for Upright {
    const NAME: &'static str = "upright";
    const WGSL: &'static str = "
        struct Params { lean: f32 }
        fn eval(x: array<vec3f, N>, p: Params) -> Eval {
            let along = vec3f(1.0, 0.0, 0.0);
            return Eval(x[0].x - x[1].x - p.lean, array<vec3f, N>(along, -along));
        }";
    type Params<T: Real> = [T; 1];
    type Material = ();

    fn from_rest<T: Real>([x1, x2]: &[Point3<T>; 2], _: &()) -> [T; 1] {
        [x1.x - x2.x]
    }

    fn eval<T: Real>([x1, x2]: &[Point3<T>; 2], &[lean]: &[T; 1]) -> Eval<T, 2> {
        Eval { c: x1.x - x2.x - lean, grad: [Vector3::x(), -Vector3::x()] }
    }

    fn rest_size<T: Real>(&[lean]: &[T; 1]) -> T {
        lean.simd_abs()
    }
}

/// An oriented constraint may have a torque, but no force. One that has no torque is refused.
#[test]
fn only_an_oriented_constraint_may_have_a_torque() {
    let verdict = |subject: &Subject<Upright, 2>| checks::momentum(subject).verdict();
    assert_eq!(verdict(&Subject::new([()])), Verdict::Failed);
    assert_eq!(verdict(&Subject::new([()]).oriented()), Verdict::Passed);
    let pushes = Subject::<OneSided, 2>::new([()]).oriented();
    assert_eq!(checks::momentum(&pushes).verdict(), Verdict::Failed);
    let without_torque = Subject::<Stretch, 2>::new([()]).oriented();
    assert_eq!(checks::momentum(&without_torque).verdict(), Verdict::Failed);
}

#[test]
fn a_constraint_with_a_length_is_not_checked_for_scale() {
    let without = Subject::<AbsoluteEpsilon, 2>::new([()]);
    assert_eq!(checks::scale(&without).verdict(), Verdict::Failed);
    let with = Subject::<AbsoluteEpsilon, 2>::new([()]).with_own_length();
    assert!(matches!(checks::scale(&with).verdict(), Verdict::Skipped(_)));
}
