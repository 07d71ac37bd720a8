//! P8: a beam under its own weight reaches the equilibrium of Newton's method within 1 %, at every
//! scale, on CPU and GPU. `cargo xtask cantilever` and `tests/python/cantilever.py` compare
//! Newton's method with an independent FEM program.
//!
//! At another scale gravity stays the same and the moduli grow with the length. The beam then sinks
//! by the same share of its length, and times grow with the square root of the scale.

use cutis_constraints::Scalar;
use cutis_studies::cantilever::{Beam, GRAVITY_M_S2, Material, converged, settle};

use super::{SCALES, Start, at_most, cpu, on_each_adapter, within};

const CELLS: [usize; 3] = [8, 2, 2];
/// A beam that sinks by a tenth of its length.
const SOFT: Material = Material { youngs_pa: 5e5, bulk_pa: 5e5, density_kg_m3: 1000.0 };

fn at_scale(material: Material, scale: f64) -> Material {
    let Material { youngs_pa, bulk_pa, .. } = material;
    Material { youngs_pa: youngs_pa * scale, bulk_pa: bulk_pa * scale, ..material }
}

/// Expected deflection of the end over the length of the beam.
fn reference(beam: &Beam, material: &Material) -> f64 {
    -beam.end_displacement(&beam.equilibrium(material, GRAVITY_M_S2).unwrap().positions).y
}

/// Deflection of the end by the solver. Substeps are a share of the time in which a wave crosses a
/// cell.
fn sag<T: Scalar>(start: &Start<T>, scale: f64, material: Material, share: f64) -> (f64, f64) {
    let beam = Beam::new(CELLS, 1, scale).unwrap();
    let right = at_scale(SOFT, scale);
    let expected = reference(&beam, &right);
    let cell = beam.length_m / CELLS[0] as f64;
    let crossing_s = cell * (right.density_kg_m3 / right.youngs_pa).sqrt();
    let way = converged(expected * beam.length_m, share * crossing_s, 10);
    let material = at_scale(material, scale);
    let still = if size_of::<T>() == 8 { 1e-8 } else { 1e-4 };
    let system = beam.system::<T>(&material, None).unwrap();
    let mut solver = start(system, way.settings());
    let rest = settle(&mut *solver, &beam, still, way.most_frames).unwrap();
    assert!(rest.at_rest, "still moving after {} s", rest.time_s);
    (-rest.displacement[1], expected)
}

fn check<T: Scalar>(start: &Start<T>, scale: f64, material: Material, share: f64) -> Result<(), String> {
    let (found, expected) = sag(start, scale, material, share);
    within(found, expected, 0.01)
}

#[test]
fn the_beam_sags_to_the_equilibrium_of_newton() {
    for scale in SCALES {
        check(&cpu::<f64>, scale, SOFT, 0.5).unwrap();
        check(&cpu::<f32>, scale, SOFT, 1.0).unwrap();
    }
}

#[test]
fn the_beam_sags_to_the_equilibrium_of_newton_on_the_gpu() {
    // The largest and the smallest scale are the hard ones in f32, and a software device is slow.
    for scale in [SCALES[0], SCALES[2]] {
        on_each_adapter(|start| check(start, scale, SOFT, 1.0));
    }
}

#[test]
fn the_error_falls_with_the_square_of_the_substep() {
    let apart = |share| {
        let (found, expected) = sag(&cpu::<f64>, 1.0, SOFT, share);
        (found / expected - 1.0).abs()
    };
    let (half, whole) = (apart(0.25), apart(0.5));
    at_most("error at half the substep", half, 0.35 * whole).unwrap();
}

#[test]
fn control_another_material_is_refused() {
    check(&cpu::<f64>, 1.0, Material { bulk_pa: 0.5 * SOFT.bulk_pa, ..SOFT }, 0.5).unwrap_err();
    check(&cpu::<f64>, 1.0, Material { youngs_pa: 1.03 * SOFT.youngs_pa, ..SOFT }, 0.5).unwrap_err();
    check(&cpu::<f64>, 1.0, Material { density_kg_m3: 1.03 * SOFT.density_kg_m3, ..SOFT }, 0.5).unwrap_err();
}
