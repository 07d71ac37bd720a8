//! The derivative check accepts correct derivatives and rejects wrong ones.

use cutis_coloring::greedy;
use cutis_constraints::{Constraint, Distance, Eval, Real};
use cutis_newton::Problem;
use cutis_solver::{Stiffness, SystemBuilder};
use nalgebra::Point3;

use crate::SCALES;
use crate::blocks::{shaken, skinned};

#[test]
fn derivatives_of_all_kinds_match_the_energy() {
    for scale in SCALES {
        let problem = Problem::of(&skinned([4, 3, 5], scale), [0.0, 0.1, -0.2]).unwrap();
        let x = shaken(problem.positions(), 0.1 * scale, |_| false);
        let found = problem.check_derivatives(&x, 10).unwrap();
        assert!(found.gradient < 1e-8 && found.hessian < 1e-7, "{found:?} at scale {scale}");
    }
}

/// A distance whose gradient is too long by a factor of 1e-6.
struct TooLong;

impl Constraint<2> for TooLong {
    const NAME: &'static str = "too long";
    const WGSL: &'static str = "";
    type Params<T: Real> = [T; 1];
    type Material = <Distance as Constraint<2>>::Material;
    fn from_rest<T: Real>(x: &[Point3<T>; 2], material: &Self::Material) -> [T; 1] {
        Distance::from_rest(x, material)
    }
    fn eval<T: Real>(x: &[Point3<T>; 2], params: &[T; 1]) -> Eval<T, 2> {
        let Eval { c, grad } = Distance::eval(x, params);
        Eval { c, grad: grad.map(|gradient| gradient * T::constant(1.000_001)) }
    }
    fn rest_size<T: Real>(params: &[T; 1]) -> T {
        Distance::rest_size(params)
    }
}

#[test]
fn control_a_gradient_a_millionth_too_long_is_noticed() {
    let positions = [Point3::new(0.0, 0.0, 0.0), Point3::new(1.0, 0.1, 0.0), Point3::new(0.2, 1.0, 0.4)];
    let springs = [[0, 1], [1, 2]];
    let groups = greedy(&springs, 3).unwrap();
    let system = SystemBuilder::<f64>::new(&positions, &[0.0, 1.0, 1.0])
        .unwrap()
        .add::<TooLong, 2>(&springs, &[[0.9], [1.2]], Stiffness::compliance(1.0), &groups)
        .unwrap()
        .build();
    let problem = Problem::of(&system, [0.0; 3]).unwrap();
    let found = problem.check_derivatives(&positions, 10).unwrap();
    assert!(found.gradient > 1e-7, "{found:?}");
}
