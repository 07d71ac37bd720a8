//! Skin strips in the scan: forces, modulus, and zeros without rounding.

use cutis_constraints::{
    Constraint, Eval, Params, Scalar, SkinStrip, SkinStripAtRest, SkinStripLaw, SkinStripMaterial,
    SkinStripTurn,
};
use cutis_test_kit::Random;
use nalgebra::{Matrix2, Point3, SimdValue, Vector2, Vector3};
use proptest::prelude::*;

use crate::shapes::SCALES;
use crate::strips::{StripCase, strip_case};

/// `b1, b2, b3` from plane coordinates: the solution of `Σ b_i u_i = d`, `Σ b_i = 0`.
fn weights_of_the_plane(x: &[Point3<f64>; 3], material: &SkinStripMaterial) -> [f64; 3] {
    let (d, n) = (material.direction(), material.normal());
    let across = n.cross(d);
    let plane = |v: Vector3<f64>| Vector2::new(v.dot(d), v.dot(&across));
    let (u1, u2) = (plane(x[0] - x[2]), plane(x[1] - x[2]));
    let b = Matrix2::from_columns(&[u1, u2]).try_inverse().unwrap() * Vector2::new(1.0, 0.0);
    [b.x, b.y, -b.x - b.y]
}

/// Forces `−(C/α) ∇C` in the scan, in N.
fn forces<C: Constraint<3, Material = SkinStripMaterial>>(case: &StripCase) -> [Vector3<f64>; 3] {
    let params: C::Params<f64> = C::from_rest(&case.scan.x, &case.material);
    let Eval { c, grad } = C::eval(&case.scan.x, &params);
    let stiffness = 1.0 / case.material.compliance(&case.scan.x).unwrap();
    grad.map(|g| g * (-c * stiffness))
}

/// Largest difference of the in-plane forces from those of a membrane with the tension `τ`,
/// relative to the largest force. `turn` turns the membrane's direction in the plane.
fn membrane_error(case: &StripCase, turn: f64) -> f64 {
    let StripCase { scan, material, .. } = case;
    let area = material.shape(&scan.x).unwrap().projected_area;
    let n = material.normal();
    let d = material.direction() * turn.cos() + n.cross(material.direction()) * turn.sin();
    let turned = SkinStripMaterial::new((*n).into(), d.into(), *material.law()).unwrap();
    let scale = material.law().tension_n_per_m * area;
    let wanted = weights_of_the_plane(&scan.x, &turned).map(|b| d * (-scale * b));
    let found = forces::<SkinStrip>(case).map(|f| f - n * n.dot(&f));
    let largest = |f: &[Vector3<f64>; 3]| f.iter().map(Vector3::norm).fold(0.0, f64::max);
    let difference = std::array::from_fn(|i| found[i] - wanted[i]);
    largest(&difference) / largest(&wanted)
}

/// Growth of the tension per strain of the skin along the strip, from the energies of three shapes.
fn modulus(case: &StripCase, alpha: f64) -> f64 {
    let StripCase { scan, material, .. } = case;
    let d = material.direction();
    let step = 1e-3;
    let energy = |strain: f64| {
        let x = scan.x.map(|p| p + d * (strain * p.coords.dot(d)));
        let c = SkinStrip::eval(&x, &case.params()).c;
        c * c / (2.0 * alpha)
    };
    let curvature = (energy(step) - 2.0 * energy(0.0) + energy(-step)) / (step * step);
    curvature / material.shape(&scan.x).unwrap().projected_area
}

proptest! {
    #[test]
    fn the_image_is_the_direction_in_the_skin(case in strip_case(1e3)) {
        let StripCase { scan, material, .. } = case;
        let shape = material.shape(&scan.x).unwrap();
        let f = case.image(&scan.x) / shape.length;
        let n = material.normal();
        let in_plane = f - n * n.dot(&f);
        prop_assert!((in_plane - material.direction()).norm() < 1e-9, "{in_plane}");
        prop_assert!((f.norm() - shape.steepness).abs() < 1e-12 * shape.steepness);
        // Control: another order of the vertices needs other weights. A cyclic one moves each
        // direction, because it acts on the plane like a turn by 120° of a stretched triangle.
        let [x1, x2, x3] = scan.x;
        let turned = case.image(&[x2, x3, x1]) / shape.length;
        prop_assert!((turned - n * n.dot(&turned) - material.direction()).norm() > 1e-6);
    }

    #[test]
    fn the_force_in_the_scan_is_that_of_a_membrane(case in strip_case(1e3)) {
        prop_assume!(case.material.law().tension_n_per_m > 1e-3 * case.material.law().modulus_n_per_m);
        let error = membrane_error(&case, 0.0);
        prop_assert!(error < 1e-8, "{error}");
        prop_assert!(membrane_error(&case, 1e-2) > 1e-3, "control: turned by half a degree");
        for f in forces::<SkinStripAtRest>(&case).iter().chain(&forces::<SkinStripTurn>(&case)) {
            prop_assert_eq!(*f, Vector3::zeros());
        }
    }

    /// The modulus is `T` for any slope. A stiffness of `T g0²`, which ignores that the image turns
    /// under tension, gives `T + τ(1 − 1/g0²)` (control).
    #[test]
    fn the_modulus_in_the_skin_is_that_of_the_law(case in strip_case(1e-9)) {
        let SkinStripLaw { tension_n_per_m: tension, modulus_n_per_m: wanted, compression, .. } = *case.material.law();
        let shape = case.material.shape(&case.scan.x).unwrap();
        prop_assume!(shape.steepness < SkinStripMaterial::STEEPEST);
        // Without tension the strip wrinkles in the compressed one of the three shapes.
        prop_assume!(compression == 1.0 || tension > 0.1 * wanted);
        let alpha = case.material.compliance(&case.scan.x).unwrap();
        let found = modulus(&case, alpha);
        prop_assert!((found / wanted - 1.0).abs() < 1e-3, "{found} instead of {wanted}");
        prop_assert!((modulus(&case, alpha * 1.01) / wanted - 1.0).abs() > 5e-3);
    }
}

/// A triangle whose plane rises along x with the steepness `g0`, and its strip along x.
fn tilted(steepness: f64, law: SkinStripLaw) -> ([Point3<f64>; 3], SkinStripMaterial) {
    let slope = (steepness * steepness - 1.0).sqrt();
    let x = [[0.0, 0.0], [2.0, 0.3], [0.4, 1.7]].map(|[x, y]| Point3::new(x, y, slope * x) * 1e-3);
    (x, SkinStripMaterial::new([0.0, 0.0, 1.0], [1.0, 0.0, 0.0], law).unwrap())
}

const LAW: SkinStripLaw =
    SkinStripLaw { tension_n_per_m: 20.0, modulus_n_per_m: 50.0, stiffening: 0.0, compression: 1.0 };

/// Nominal tension in N/m at a strain of the skin along the strip, at fixed heights.
fn tension(x: &[Point3<f64>; 3], material: &SkinStripMaterial, strain: f64) -> f64 {
    let moved = x.map(|p| Point3::new(p.x * (1.0 + strain), p.y, p.z));
    let Eval { c, grad } = SkinStrip::eval(&moved, &SkinStrip::from_rest(x, material));
    let virial: f64 = (0..3).map(|i| c * grad[i].x * x[i].x).sum();
    virial / material.compliance(x).unwrap() / material.shape(x).unwrap().projected_area
}

/// A facet steeper than [`SkinStripMaterial::STEEPEST`] keeps its tension and loses modulus.
#[test]
fn a_steep_facet_keeps_its_tension() {
    let step = 1e-6;
    let mut last = LAW.modulus_n_per_m * (1.0 + 1e-6);
    for steepness in [1.0, 2.0, 4.9, 5.1, 7.0, 12.0, 19.0] {
        let (x, material) = tilted(steepness, LAW);
        let found = tension(&x, &material, 0.0);
        assert!((found / LAW.tension_n_per_m - 1.0).abs() < 1e-12, "{found} at {steepness}");
        let modulus = (tension(&x, &material, step) - tension(&x, &material, -step)) / (2.0 * step);
        let exact = (modulus / LAW.modulus_n_per_m - 1.0).abs() < 1e-6;
        assert_eq!(exact, steepness < SkinStripMaterial::STEEPEST, "{modulus} at {steepness}");
        assert!(modulus > LAW.tension_n_per_m && modulus <= last, "{modulus} at {steepness}");
        last = modulus * (1.0 + 1e-6);
    }
}

/// Stiffening adds `T β ε²/2` to the tension, on a flat facet and on a slope.
#[test]
fn stiffening_does_not_depend_on_the_slope() {
    let strain = 0.02;
    for steepness in [1.0, 1.4, 2.0] {
        let law = SkinStripLaw { tension_n_per_m: 0.5, stiffening: 30.0, ..LAW };
        let (x, material) = tilted(steepness, law);
        let (_, plain) = tilted(steepness, SkinStripLaw { stiffening: 0.0, ..law });
        let added = tension(&x, &material, strain) - tension(&x, &plain, strain);
        let wanted = 0.5 * law.modulus_n_per_m * law.stiffening * strain * strain;
        assert!((added / wanted - 1.0).abs() < 0.1, "{added} instead of {wanted} at {steepness}");
        assert_eq!(tension(&x, &material, -strain), tension(&x, &plain, -strain));
    }
}

/// Number of values that are not zero in the scan, of `rounds` random triangles, in scalar code and
/// in a lane. `params` gives the parameters.
fn not_zero<C, T: Scalar>(
    rounds: usize,
    params: impl Fn(&[Point3<T>; 3], &SkinStripMaterial) -> C::Params<T>,
) -> usize
where
    C: Constraint<3, Material = SkinStripMaterial>,
{
    let mut random = Random::new(11);
    let mut found = 0;
    for round in 0..rounds {
        let scale = SCALES[round % 3];
        let x: [Point3<T>; 3] = std::array::from_fn(|_| {
            (random.point() * scale + Vector3::new(0.3, -0.2, 0.9) * scale).map(T::constant)
        });
        let law = SkinStripLaw { tension_n_per_m: 49.0 * random.uniform(), stiffening: 3.0, ..LAW };
        let material = SkinStripMaterial::new(random.vector().into(), random.vector().into(), law).unwrap();
        let params = params(&x, &material);
        let scalar = C::eval(&x, &params);
        let in_lanes = C::eval(
            &x.map(|p| p.map(|v| T::lanes(|_| v))),
            &Params::from_fn(|k| T::lanes(|_| params.as_ref()[k])),
        );
        found += usize::from(scalar.c != T::zero()) + usize::from(in_lanes.c.extract(1) != T::zero());
    }
    found
}

fn check_zeros<C: Constraint<3, Material = SkinStripMaterial>>() {
    assert_eq!(not_zero::<C, f32>(2000, C::from_rest), 0, "{}", C::NAME);
    assert_eq!(not_zero::<C, f64>(2000, C::from_rest), 0, "{}", C::NAME);
    // Control: parameters from another number type are off by rounding.
    let rounded = |x: &[Point3<f32>; 3], material: &SkinStripMaterial| {
        let params: C::Params<f64> = C::from_rest(&x.map(|p| p.map(f64::from)), material);
        Params::from_fn(|k| params.as_ref()[k] as f32)
    };
    assert!(not_zero::<C, f32>(2000, rounded) > 1000, "{}", C::NAME);
}

#[test]
fn nothing_pulls_in_the_scan() {
    check_zeros::<SkinStripAtRest>();
    check_zeros::<SkinStripTurn>();
}
