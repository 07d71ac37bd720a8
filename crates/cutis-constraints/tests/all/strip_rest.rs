//! Skin strips in the scan: forces, modulus, and zeros without rounding.

use cutis_constraints::{
    Constraint, Eval, LaneTask, Lanes, Params, Scalar, SimdLevel, SkinStrip, SkinStripAtRest, SkinStripLaw,
    SkinStripMaterial, SkinStripTurn,
};
use cutis_test_kit::Random;
use nalgebra::{Matrix2, Point3, SimdBool, Vector2, Vector3};
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

/// Largest difference of the forces from those of a membrane with the tension `τ`,
/// relative to the largest force. `turn` turns the membrane's direction in the plane.
fn membrane_error(case: &StripCase, turn: f64) -> f64 {
    let StripCase { scan, material, .. } = case;
    let [x1, x2, x3] = scan.x;
    let n = material.normal();
    let area = 0.5 * n.dot(&(x2 - x1).cross(&(x3 - x1)));
    let d = material.direction() * turn.cos() + n.cross(material.direction()) * turn.sin();
    let turned = SkinStripMaterial::new((*n).into(), d.into(), *material.law()).unwrap();
    let scale = material.law().tension_n_per_m * area;
    let wanted = weights_of_the_plane(&scan.x, &turned).map(|b| d * (-scale * b));
    let found = forces::<SkinStrip>(case);
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
        prop_assert!((f - material.direction()).norm() < 1e-9, "{f}");
        // Control: another order of the vertices needs other weights. A cyclic one moves each
        // direction, because it acts on the plane like a turn by 120° of a stretched triangle.
        let [x1, x2, x3] = scan.x;
        let n = material.normal();
        let turned = case.image(&[x2, x3, x1]) / shape.length;
        prop_assert!((turned - n * n.dot(&turned) - material.direction()).norm() > 1e-6);
    }

    #[test]
    fn the_force_in_the_scan_is_that_of_a_membrane(case in strip_case(1e3)) {
        prop_assume!(case.material.law().tension_n_per_m > 1e-3 * case.material.law().modulus_n_per_m);
        // Seen from its edge, a triangle has no plane coordinates.
        prop_assume!(case.facing().abs() > 1e-2);
        let error = membrane_error(&case, 0.0);
        prop_assert!(error < 1e-8, "{error}");
        prop_assert!(membrane_error(&case, 1e-2) > 1e-3, "control: turned by half a degree");
        for f in forces::<SkinStripAtRest>(&case).iter().chain(&forces::<SkinStripTurn>(&case)) {
            prop_assert_eq!(*f, Vector3::zeros());
        }
    }

    /// The modulus is `T` for any slope, up to that of [`SkinStripMaterial::LEAST_FACING`].
    #[test]
    fn the_modulus_in_the_skin_is_that_of_the_law(case in strip_case(1e-9)) {
        let SkinStripLaw { tension_n_per_m: tension, modulus_n_per_m: wanted, compression, .. } = *case.material.law();
        prop_assume!(case.facing() > SkinStripMaterial::LEAST_FACING);
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

/// A facet of any slope has the tension and the modulus of the law.
#[test]
fn the_slope_changes_nothing() {
    let step = 1e-6;
    for steepness in [1.0, 2.0, 5.0, 12.0, 19.0] {
        let (x, material) = tilted(steepness, LAW);
        let found = tension(&x, &material, 0.0);
        assert!((found / LAW.tension_n_per_m - 1.0).abs() < 1e-12, "{found} at {steepness}");
        let modulus = (tension(&x, &material, step) - tension(&x, &material, -step)) / (2.0 * step);
        assert!((modulus / LAW.modulus_n_per_m - 1.0).abs() < 1e-6, "{modulus} at {steepness}");
    }
}

/// A triangle that is seen from its edge joins the two levels of a step: it passes the tension on,
/// and it resists a shift of one level over the other.
#[test]
fn a_wall_joins_the_levels_of_a_step() {
    let x = wall();
    let across = SkinStripMaterial::new([0.0, 0.0, 1.0], [1.0, 0.0, 0.0], LAW).unwrap();
    let force = |x: &[Point3<f64>; 3]| {
        let Eval { c, grad } = SkinStrip::eval(x, &SkinStrip::from_rest(&wall(), &across));
        grad.map(|g| g * (-c / across.compliance(&wall()).unwrap()))
    };
    // The lower edge is 2 mm wide, and half of the wall is in this triangle.
    let [a, b, c] = force(&x);
    let wanted = 0.5 * LAW.tension_n_per_m * 2e-3;
    assert!((c.x.abs() - wanted).abs() < 1e-12 && (a + b + c).norm() < 1e-15, "{c}");
    // The upper corner moves by 0.1 mm over the others.
    let shift = 1e-4;
    let mut shifted = x;
    shifted[2].x -= shift * c.x.signum();
    let more = force(&shifted)[2].x.abs() - wanted;
    let area = 3e-6;
    let stiffness = LAW.modulus_n_per_m * 2e-3 * 2e-3 / (4.0 * SkinStripMaterial::LEAST_FACING * area);
    assert!((more / (stiffness * shift) - 1.0).abs() < 1e-9, "{more}");
    // A strip along the wall has no force, and the wall cannot hold it.
    let along = SkinStripMaterial::new([0.0, 0.0, 1.0], [0.0, 1.0, 0.0], LAW).unwrap();
    assert!(along.compliance(&x).is_err());
}

fn wall() -> [Point3<f64>; 3] {
    [[0.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 1.0, 3.0]].map(|p| Point3::from(p.map(|v| v * 1e-3)))
}

/// Motion along the normal changes the length of a strip to second order only, on any slope. Two
/// triangles of opposite slope are therefore no bellows: they do not stretch by becoming flat.
#[test]
fn a_fold_does_not_open() {
    for steepness in [1.0, 1.4, 5.0] {
        let (x, material) = tilted(steepness, LAW);
        let params = SkinStrip::from_rest(&x, &material);
        let stretch = |flatter: f64| {
            let moved = x.map(|p| Point3::new(p.x, p.y, p.z * (1.0 - flatter)));
            SkinStrip::eval(&moved, &params).c - SkinStrip::eval(&x, &params).c
        };
        let (slope, share) = ((steepness * steepness - 1.0f64).sqrt(), 1e-3);
        let length = material.shape(&x).unwrap().length;
        assert!(stretch(share).abs() <= 0.51 * (slope * share).powi(2) * length, "{steepness}");
        // Control: an image that keeps the slope of the triangle shortens to first order.
        let sloped = |p: &[Point3<f64>; 3]| {
            let [b1, b2, ..] = params;
            ((p[0] - p[2]) * b1 + (p[1] - p[2]) * b2).norm()
        };
        let flatter = x.map(|p| Point3::new(p.x, p.y, p.z * (1.0 - share)));
        let shorter = sloped(&x) - sloped(&flatter);
        assert!(steepness == 1.0 || shorter > 0.3 * slope * share * length, "{shorter} at {steepness}");
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

/// Counts the lanes in which a constraint is not zero.
struct NotZero<'a, C: Constraint<3>, T: Scalar> {
    x: &'a [Point3<T>; 3],
    params: &'a C::Params<T>,
    found: &'a mut usize,
}

impl<C: Constraint<3>, T: Scalar> LaneTask<T> for NotZero<'_, C, T> {
    fn run<L: Lanes<T>>(self) {
        let x = self.x.map(|p| p.map(L::splat));
        let params = Params::from_fn(|k| L::splat(self.params.as_ref()[k]));
        *self.found += usize::from(C::eval(&x, &params).c.simd_ne(L::zero()).any());
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
        found += usize::from(C::eval(&x, &params).c != T::zero());
        for level in SimdLevel::available() {
            T::in_lanes(level, NotZero::<C, T> { x: &x, params: &params, found: &mut found });
        }
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
