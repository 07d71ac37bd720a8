//! Starts from which plain Newton would not converge: compressed, inverted, balanced and loose
//! bodies.

use cutis_coloring::greedy;
use cutis_constraints::{Constraint, Distance, Eval, Real};
use cutis_newton::{NewtonError, Options, Problem};
use cutis_solver::{Stiffness, SystemBuilder};
use nalgebra::{Point3, Rotation3, Vector3};

use crate::blocks::{hanging, shaken, skinned};
use crate::closed_forms::chain;
use crate::{SCALES, near};

/// The equilibrium of a mass of weight 1 N on a spring of 10 N/m and 1 m above a fixed point, and
/// whether it is definite. `angle` is the angle of the start from upright.
fn pendulum(angle: f64) -> (Point3<f64>, bool) {
    let start = [Point3::origin(), Point3::new(angle.sin(), 0.0, angle.cos())];
    let system = chain(&start, &[0.0, 1.0], 1.0, 0.1);
    let problem = Problem::of(&system, [0.0, 0.0, -1.0]).unwrap();
    let rest = problem.equilibrium(&start, &Options::default()).unwrap();
    (rest.positions[1], rest.definite)
}

#[test]
fn a_saddle_is_distinguished_from_a_minimum() {
    let (balanced, definite) = pendulum(0.0);
    near("height", balanced.z, 0.9, 1.0, 1e-12).unwrap();
    assert!(!definite, "a saddle");
    let (hanging, definite) = pendulum(0.01);
    near("height", hanging.z, -1.1, 1.0, 1e-12).unwrap();
    assert!(definite, "a minimum");
}

#[test]
fn a_spring_compressed_to_a_hundredth_recovers() {
    for scale in SCALES {
        let start = [Point3::origin(), Point3::new(0.01 * scale, 1e-3 * scale, 0.0)];
        let problem = Problem::of(&chain(&start, &[0.0, 1.0], scale, 1.0), [0.0; 3]).unwrap();
        let rest = problem.equilibrium(&start, &Options::default()).unwrap();
        near("length", (rest.positions[1] - rest.positions[0]).norm(), scale, scale, 1e-12).unwrap();
    }
}

#[test]
fn a_body_at_rest_is_its_own_equilibrium() {
    for scale in SCALES {
        let problem = Problem::of(&hanging(4, scale), [0.0; 3]).unwrap();
        let start = shaken(problem.positions(), 0.2 * scale, |v| problem.masses()[v].is_infinite());
        let rest = problem.equilibrium(&start, &Options::default()).unwrap();
        let worst = rest.positions.iter().zip(problem.positions()).map(|(a, b)| (a - b).norm());
        near("worst deviation", worst.fold(0.0, f64::max), 0.0, scale, 1e-9).unwrap();
        let again = problem.equilibrium(&rest.positions, &Options::default()).unwrap();
        assert!(again.iterations <= 1, "{}", again.iterations);
        let unmoved = problem.equilibrium(problem.positions(), &Options::default()).unwrap();
        near("worst deviation", relative(&unmoved.positions, problem.positions()), 0.0, scale, 1e-14)
            .unwrap();
    }
}

fn relative(a: &[Point3<f64>], b: &[Point3<f64>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

#[test]
fn a_scrambled_body_ends_in_a_minimum() {
    for scale in SCALES {
        let problem = Problem::of(&skinned([4, 4, 4], scale), [0.0, 0.0, -0.01]).unwrap();
        let start = shaken(problem.positions(), 0.8 * scale, |v| problem.masses()[v].is_infinite());
        let rest =
            problem.equilibrium(&start, &Options { max_iterations: 500, ..Options::default() }).unwrap();
        assert!(rest.gradient <= 1e-10, "{rest:?}");
    }
}

/// A body that is held only by a hinge can turn without a force, so it has infinitely many
/// equilibria.
#[test]
fn a_body_on_a_hinge_has_no_definite_minimum() {
    let corners = [Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(0.5, 0.8, 0.0)];
    let mut system = chain(&corners, &[0.0, 0.0, 1.0], 1.0, 1.0);
    let problem = Problem::of(&system, [0.0; 3]).unwrap();
    assert!(!problem.equilibrium(&corners, &Options::default()).unwrap().definite);
    system = chain(&corners, &[1.0, 1.0, 1.0], 1.0, 1.0);
    let problem = Problem::of(&system, [0.0; 3]).unwrap();
    let floating = problem.equilibrium(&corners, &Options::default()).unwrap_err();
    assert_eq!(floating, NewtonError::Floating { vertex: 0, vertices: 3 });
}

/// Keeps the distance of a vertex from a point in space: a spring whose other end is not a vertex.
struct Tether;

impl Constraint<1> for Tether {
    const NAME: &'static str = "tether";
    const WGSL: &'static str = "";
    type Params<T: Real> = [T; 4];
    type Material = ();
    fn from_rest<T: Real>(_: &[Point3<T>; 1], _: &()) -> [T; 4] {
        [T::zero(); 4]
    }
    fn eval<T: Real>([x]: &[Point3<T>; 1], &[px, py, pz, length]: &[T; 4]) -> Eval<T, 1> {
        let way = x - Point3::new(px, py, pz);
        let norm = way.dot(&way).simd_sqrt();
        Eval { c: norm - length, grad: [way * (T::one() / norm)] }
    }
    fn rest_size<T: Real>(&[_, _, _, length]: &[T; 4]) -> T {
        length
    }
}

/// No vertex is fixed, but a constraint ties the body to a place. It hangs there and is not
/// reported as floating.
#[test]
fn a_body_tied_by_a_constraint_has_an_equilibrium() {
    let start = [Point3::new(0.8, 0.0, 0.1), Point3::new(1.5, 0.0, -0.5)];
    let one = greedy(&[[0]], 2).unwrap();
    let system = SystemBuilder::<f64>::new(&start, &[1.0, 1.0])
        .unwrap()
        .add::<Tether, 1>(&[[0]], &[[0.0, 0.0, 0.0, 1.0]], Stiffness::compliance(0.1), &one)
        .unwrap()
        .add::<Distance, 2>(&[[0, 1]], &[[1.0]], Stiffness::compliance(0.1), &greedy(&[[0, 1]], 2).unwrap())
        .unwrap()
        .build();
    let problem = Problem::of(&system, [0.0, 0.0, -1.0]).unwrap();
    let rest = problem.equilibrium(&start, &Options::default()).unwrap();
    near("upper", rest.positions[0].z, -1.2, 1.0, 1e-12).unwrap();
    near("lower", rest.positions[1].z, -2.3, 1.0, 1e-12).unwrap();
    assert!(rest.definite && problem.check_derivatives(&start, 5).unwrap().hessian < 1e-7);
}

/// Rotating and moving a problem rotates and moves its solution. A distance of a million body sizes
/// from the origin costs six digits.
#[test]
fn the_solution_is_independent_of_place_and_orientation() {
    let turn = Rotation3::from_euler_angles(0.3, -0.7, 1.1);
    let gravity = Vector3::new(0.0, 0.0, -1e-3);
    let plain = Problem::of(&hanging(4, 1.0), gravity.into()).unwrap();
    let at_home = plain.equilibrium(plain.positions(), &Options::default()).unwrap();
    for (shift, tolerance) in [(0.0, 1e-10), (1e6, 1e-8)] {
        let away = |p: &Point3<f64>| turn * p + Vector3::new(shift, -shift, shift);
        let start: Vec<_> = plain.positions().iter().map(away).collect();
        let masses: Vec<f64> = plain.masses().iter().map(|m| 1.0 / m).collect();
        let system = crate::blocks::hanging_at(4, 1.0, &start, &masses);
        let problem = Problem::of(&system, (turn * gravity).into()).unwrap();
        let found = problem.equilibrium(&start, &Options::default()).unwrap();
        let expected: Vec<_> = at_home.positions.iter().map(away).collect();
        near("deviation", relative(&found.positions, &expected), 0.0, 1.0, tolerance).unwrap();
    }
}
