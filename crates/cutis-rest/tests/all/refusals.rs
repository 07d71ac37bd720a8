//! Bodies and options that have no state of rest.

use cutis_constraints::Distance;
use cutis_rest::{Body, Options, RestError};
use cutis_solver::{Stiffness, SystemBuilder};
use nalgebra::Point3;

use crate::blocks::{GRAVITY_M_S2, Make};

fn spring(inverse_mass: f64, stiffness: Stiffness<f64>) -> Result<Body, RestError> {
    let positions = [Point3::origin(), Point3::new(1.0, 0.0, 0.0)];
    let groups = cutis_coloring::greedy(&[[0, 1]], 2).unwrap();
    let system = SystemBuilder::<f64>::new(&positions, &[0.0, inverse_mass])
        .unwrap()
        .add::<Distance, 2>(&[[0, 1]], &[[1.0]], stiffness, &groups)
        .unwrap()
        .build();
    Body::of(&system, GRAVITY_M_S2)
}

#[test]
fn bodies_without_an_energy_are_refused() {
    let pbd = spring(1.0, Stiffness::pbd(1.0)).err().unwrap();
    assert!(matches!(pbd, RestError::PbdStiffness { kind: "distance" }), "{pbd}");
    let rigid = spring(1.0, Stiffness::compliance(0.0)).err().unwrap();
    assert!(matches!(rigid, RestError::Rigid { constraint: 0, .. }), "{rigid}");
    let fixed = spring(0.0, Stiffness::compliance(1.0)).err().unwrap();
    assert_eq!(fixed, RestError::NothingMoves { vertices: 2 });
    let gravity = Body::of(&Make::default().system(), [0.0, f64::NAN, 0.0]).err().unwrap();
    assert!(matches!(gravity, RestError::Value { what: "gravity_m_s2", .. }), "{gravity}");
    assert!(spring(1.0, Stiffness::compliance(1.0)).is_ok(), "the control");
}

#[test]
fn options_out_of_range_are_refused() {
    let body = spring(1.0, Stiffness::compliance(1e-3)).unwrap();
    for (error, force, what) in
        [(1.1, 0.0, "error"), (-0.1, 0.0, "error"), (f64::NAN, 0.0, "error"), (0.1, 1.1, "force")]
    {
        let options = Options { error, force, ..Options::default() };
        let found = body.settle(&options, &mut |_| ()).unwrap_err();
        assert!(matches!(found, RestError::Value { what: of, .. } if of == what), "{found}");
    }
}

/// A block that nothing holds falls for ever. A spring of 1 m that hangs comes to rest.
#[test]
fn a_body_that_falls_is_an_error() {
    let falling = Make { held: false, ..Make::default() };
    let body = Body::of(&falling.system(), GRAVITY_M_S2).unwrap();
    let error = body.settle(&Options::default(), &mut |_| ()).unwrap_err();
    assert!(matches!(error, RestError::NotAtRest { .. }), "{error}");
    let hanging = spring(1.0, Stiffness::compliance(1e-3)).unwrap();
    let rest = hanging.settle(&Options { error: 1e-9, ..Options::default() }, &mut |_| ()).unwrap();
    let [_, end] = rest.positions[..] else { panic!() };
    assert!((end.coords.norm() - 1.0 - 9.81e-3).abs() < 1e-9 && end.x.abs() < 1e-6, "{end}");
}
