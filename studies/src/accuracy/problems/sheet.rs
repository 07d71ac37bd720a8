//! P5: a slit in a stretched sheet of springs with skin tension.

use cutis_coloring::greedy;
use cutis_constraints::{Distance, SkinTension};
use cutis_solver::{Formulation, Settings, Stiffness, System, SystemBuilder};

use super::{Failure, Problem};
use crate::sheet::Sheet;

/// Prestrain.
const STRAIN: f64 = 0.002;
/// Area stiffness of the triangles over the stiffness of the springs.
const AREA_STIFFNESS: f64 = 1.0;

/// A sheet of `nx` columns with a slit of a fifth of its width. Springs have 1 N/m, vertices 1 kg
/// and a distance of 1 m.
///
/// # Errors
/// The builder refuses the system. This does not happen, because the system is valid.
pub fn wound(nx: i64) -> Result<Problem, Failure> {
    let half_length = nx as f64 / 10.0;
    let sheet = Sheet::new(nx).cut(half_length);
    let (springs, area) = (Stiffness::compliance(1.0), Stiffness::compliance((1.0 / AREA_STIFFNESS) as f32));
    let xpbd = system(&sheet, springs, area)?;
    let pbd = system(&sheet, Stiffness::pbd(1.0), Stiffness::pbd(1.0))?;
    // Slowest shear wave across the sheet, √(μ·√3/2) for unit masses; critically damped.
    let slowest = 0.61 * std::f64::consts::PI * std::f64::consts::SQRT_2 / nx as f64;
    Ok(Problem {
        name: "sheet",
        what: format!(
            "P5: a sheet of {nx} columns of springs with skin tension (k_A = {AREA_STIFFNESS}), biaxial prestrain {STRAIN}, \
             with a slit of half-length {half_length}; it opens"
        ),
        xpbd,
        vbd: None,
        pbd: Some(pbd),
        settings: Settings {
            formulation: Formulation::Xpbd,
            dt_s: 0.5 / slowest,
            damping_per_s: 2.0 * slowest,
            ..Settings::default()
        },
        instants: vec![1, 3],
        compared_at: 4,
        most_frames: 60,
        opening: Some((Box::new(move |x| sheet.opening(x)), "spacings")),
        few_settings: false,
    })
}

fn system(sheet: &Sheet, springs: Stiffness<f32>, area: Stiffness<f32>) -> Result<System<f32>, Failure> {
    let count = sheet.positions.len();
    let rest_length = 1.0 / (1.0 + STRAIN);
    let rest_area = 3f64.sqrt() / 4.0 * rest_length * rest_length;
    let inverse_masses: Vec<f32> = sheet.held.iter().map(|&held| if held { 0.0 } else { 1.0 }).collect();
    let lengths = vec![[rest_length as f32]; sheet.springs.len()];
    let areas = vec![[rest_area as f32, 0.0]; sheet.triangles.len()];
    Ok(SystemBuilder::<f32>::new(&sheet.positions, &inverse_masses)?
        .add::<Distance, 2>(&sheet.springs, &lengths, springs, &greedy(&sheet.springs, count)?)?
        .add::<SkinTension, 3>(&sheet.triangles, &areas, area, &greedy(&sheet.triangles, count)?)?
        .build())
}
