//! A new type of constraint: beads that slide on a circular wire, solved together with a spring.
//!
//! Two beads on a vertical ring are connected by a rod and released. They come to rest with the rod
//! horizontal in the lower half of the ring, at a height that is known in closed form.
//!
//! `cargo run -p cutis-solver --example own_constraint`
#![allow(clippy::print_stdout, reason = "an example prints its result")]

use cutis_constraints::{Constraint, Distance, Eval, Real};
use cutis_solver::{Settings, Solver, SolverReference, Stiffness, SystemBuilder};
use nalgebra::{Point3, Vector3};

/// Keeps a vertex on a cylinder around the y axis: `C = √(x² + z²) − r` in m.
struct OnCylinder;

impl Constraint<1> for OnCylinder {
    const NAME: &'static str = "on cylinder";
    // The same formula for the GPU backend, with the same operations in the same order.
    const WGSL: &'static str = "
        struct Params { radius: f32 }
        fn eval(x: array<vec3f, N>, p: Params) -> Eval {
            let d = vec3f(x[0].x, 0.0, x[0].z);
            let length = sqrt(dot(d, d));
            let apart = length > 0.0;
            let inverse = select(0.0, 1.0 / select(1.0, length, apart), apart);
            return Eval(length - p.radius, array<vec3f, N>(d * inverse));
        }";
    // One scalar per constraint: the radius in m.
    type Params<T: Real> = [T; 1];
    type Material = ();

    fn from_rest<T: Real>([x]: &[Point3<T>; 1], _: &()) -> [T; 1] {
        [(x.x * x.x + x.z * x.z).simd_sqrt()]
    }

    // Do not branch: this code also runs on SIMD lanes, and lanes may need different results.
    fn eval<T: Real>([x]: &[Point3<T>; 1], &[radius]: &[T; 1]) -> Eval<T, 1> {
        let zero = T::zero();
        let d = Vector3::new(x.x, zero, x.z);
        let length = d.dot(&d).simd_sqrt();
        let inverse = (T::one() / length).select(length.simd_gt(zero), zero);
        Eval { c: length - radius, grad: [d * inverse] }
    }

    fn rest_size<T: Real>(&[radius]: &[T; 1]) -> T {
        radius
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let radius = 0.1_f64;
    // Both beads start on the ring, at 10° and 80° from its highest point.
    let beads = [10.0_f64, 80.0].map(|degrees| {
        let (x, z) = degrees.to_radians().sin_cos();
        Point3::new(radius * x, 0.0, radius * z)
    });
    let rod = (beads[1] - beads[0]).norm();

    let on_ring = [[0], [1]];
    let rods = [[0, 1]];
    let stiff = || Stiffness::compliance(1e-8); // in m/N
    let system = SystemBuilder::<f64>::new(&beads, &[1.0 / 0.02; 2])? // 20 g each
        .add_from_rest::<OnCylinder, 1>(&on_ring, &(), stiff(), &cutis_coloring::greedy(&on_ring, 2)?)?
        .add_from_rest::<Distance, 2>(
            &rods,
            &Default::default(),
            stiff(),
            &cutis_coloring::greedy(&rods, 2)?,
        )?
        .build();
    let settings = Settings { gravity_m_s2: [0.0, 0.0, -9.81], damping_per_s: 3.0, ..Settings::default() };
    let mut solver = SolverReference::new(system, settings)?;

    println!("time [s]   bead 1: x, z [mm]     bead 2: x, z [mm]");
    for _ in 0..6 {
        let [a, b] = [solver.positions()?[0], solver.positions()?[1]].map(|p| p * 1e3);
        println!("{:8.1}   {:8.2} {:8.2}     {:8.2} {:8.2}", solver.time_s(), a.x, a.z, b.x, b.z);
        solver.step(120)?;
    }
    for residual in solver.residuals()? {
        println!("{}: largest relative violation {:.1e}", residual.name, residual.max);
    }
    let expected = -(radius * radius - rod * rod / 4.0).sqrt();
    let found = solver.positions()?;
    println!("height at rest: {:.3} mm, expected {:.3} mm", found[0].z * 1e3, expected * 1e3);
    assert!(found.iter().all(|p| (p.z - expected).abs() < 1e-4), "the beads are not at rest");
    Ok(())
}
