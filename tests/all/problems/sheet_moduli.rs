//! P4: the moduli of the equilateral sheet, from its energy under a uniform strain.
//!
//! `K₂ = (√3/2)k + k_A·A0` and `μ = (√3/4)k`, so that without triangles `E = 2k/√3` and `ν = 1/3`.
//! A parallelogram of the lattice stands for the endless sheet: springs on its border belong to it
//! by half.

use cutis_coloring::greedy;
use cutis_constraints::{Distance, Scalar, SkinTension};
use cutis_solver::{Stiffness, SystemBuilder, Values};
use cutis_studies::sheet::{ROW, Sheet};
use nalgebra::{Matrix2, Point3};

use super::{SCALES, within};

const K: f64 = 2.0;
const STRAIN: f64 = 1e-3;

/// Energy per area in N/m after the in-plane map `x → (1 + strain)x`.
fn energy_density<T: Scalar>(k: f64, k_area: f64, strain: Matrix2<f64>, scale: f64) -> f64 {
    let sheet = Sheet::new(12);
    let count = sheet.positions.len();
    // Neighboring triangles of a spring: two inside, one on the border.
    let share = |spring: &[u32; 2]| {
        let around = sheet.triangles.iter().filter(|triangle| spring.iter().all(|v| triangle.contains(v)));
        around.count() as f64 / 2.0
    };
    let compliances = sheet.springs.iter().map(|spring| T::constant(1.0 / (k * share(spring)))).collect();
    let mapped: Vec<Point3<f64>> = sheet
        .positions
        .iter()
        .map(|p| {
            let moved = p.xy().coords + strain * p.xy().coords;
            Point3::new(moved.x, moved.y, 0.0) * scale
        })
        .collect();
    let area = ROW / 2.0 * scale * scale;
    let lengths = vec![[T::constant(scale)]; sheet.springs.len()];
    let areas = vec![[T::constant(area), T::zero()]; sheet.triangles.len()];
    let mut builder = SystemBuilder::<T>::new(&mapped, &vec![1.0; count])
        .unwrap()
        .add::<Distance, 2>(
            &sheet.springs,
            &lengths,
            Stiffness::Compliance(Values::Each(compliances)),
            &greedy(&sheet.springs, count).unwrap(),
        )
        .unwrap();
    if k_area > 0.0 {
        let compliance = Stiffness::compliance(T::constant(scale * scale / k_area));
        let groups = greedy(&sheet.triangles, count).unwrap();
        builder = builder.add::<SkinTension, 3>(&sheet.triangles, &areas, compliance, &groups).unwrap();
    }
    let energy = builder.build().energy([0.0; 3]);
    energy.elastic_j.unwrap() / (area * sheet.triangles.len() as f64)
}

/// `U = ½K₂(tr ε)²` for equal strains, `U = 2μ·ε_xy²` for shear.
fn moduli<T: Scalar>(k: f64, k_area: f64, scale: f64) -> [f64; 2] {
    let stretch = energy_density::<T>(k, k_area, Matrix2::identity() * STRAIN, scale);
    let shear = energy_density::<T>(k, k_area, Matrix2::new(0.0, STRAIN, STRAIN, 0.0), scale);
    [stretch / (2.0 * STRAIN * STRAIN), shear / (2.0 * STRAIN * STRAIN)]
}

fn check<T: Scalar>(k: f64, k_area: f64, scale: f64, tolerance: f64) -> Result<(), String> {
    let [bulk, shear] = moduli::<T>(k, k_area, scale);
    within(bulk, ROW * K + k_area * ROW / 2.0, tolerance)?;
    within(shear, ROW / 2.0 * K, tolerance)?;
    if k_area == 0.0 {
        within(4.0 * bulk * shear / (bulk + shear), 2.0 * K / 3f64.sqrt(), tolerance)?;
        within((bulk - shear) / (bulk + shear), 1.0 / 3.0, 2.0 * tolerance)?;
    }
    Ok(())
}

#[test]
fn moduli_match_the_closed_form() {
    for scale in SCALES {
        for k_area in [0.0, 1.0, 5.0] {
            check::<f64>(K, k_area, scale, 3e-3).unwrap();
            check::<f32>(K, k_area, scale, 6e-3).unwrap();
        }
    }
}

#[test]
fn control_another_spring_stiffness_is_refused() {
    check::<f64>(K * 1.01, 0.0, 1.0, 3e-3).unwrap_err();
    check::<f64>(K * 1.01, 5.0, 1.0, 3e-3).unwrap_err();
}
