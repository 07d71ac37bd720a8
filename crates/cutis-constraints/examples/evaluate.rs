//! Evaluates a stretched spring and a stretched triangle of skin: value, gradient, compliance, and
//! the force of the material on the first vertex.
//!
//! `cargo run -p cutis-constraints --example evaluate`
#![allow(clippy::print_stdout)] // an example prints its results

use cutis_constraints::{
    Constraint, Distance, DistanceMaterial, MaterialError, SkinTension, SkinTensionMaterial,
    distance_compliance, skin_compliance,
};
use nalgebra::{Point3, Vector3};

/// Prints the value and the gradients of `C`, and the force `−(C/α) ∇C` on the first vertex.
fn report<C: Constraint<N>, const N: usize>(x: &[Point3<f64>; N], params: &C::Params<f64>, compliance: f64) {
    let eval = C::eval(x, params);
    println!("{}: C = {:.3e}, relative {:.1} %", C::NAME, eval.c, 100.0 * eval.c / C::rest_size(params));
    for (vertex, gradient) in eval.grad.iter().enumerate() {
        println!("  gradient at vertex {vertex}: {:.4?}", gradient.as_slice());
    }
    let force: Vector3<f64> = eval.grad[0] * (-eval.c / compliance);
    println!("  compliance {compliance:.3e}, force on vertex 0: {:.4?} N", force.as_slice());
}

fn main() -> Result<(), MaterialError> {
    // An edge of 1 cm in tissue of 5 kPa, whose share of the volume is 1 cm³, stretched by 20 %.
    let rest = [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0]].map(Point3::from);
    let params = Distance::from_rest(&rest, &DistanceMaterial::default());
    let compliance = distance_compliance(params[0], 5e3, 1e-6)?;
    report::<Distance, 2>(&[rest[0], Point3::new(0.012, 0.0, 0.0)], &params, compliance);

    // A triangle of skin with legs of 1 cm in its initial shape. Its rest area is 20 % smaller.
    let initial = [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0]].map(Point3::from);
    let skin = SkinTensionMaterial { rest_area_scale: 0.8, amplification: 2.0 };
    let params = SkinTension::from_rest(&initial, &skin);
    report::<SkinTension, 3>(&initial, &params, skin_compliance(params[0], 100.0)?);
    Ok(())
}
