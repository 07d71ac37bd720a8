//! P5 with `cutis-newton`: the opening of the slit in equilibrium agrees with all digits of an
//! independent program.

use cutis_coloring::greedy;
use cutis_constraints::{Distance, SkinTension};
use cutis_newton::{Options, Problem};
use cutis_solver::{Stiffness, SystemBuilder};
use cutis_studies::sheet::Sheet;

use super::{SCALES, scaled};

/// Half a unit of the last digit of the table.
const DIGITS: f64 = 5e-6;
const PRESTRAIN: f64 = 0.002;

/// Opening in spacings of a sheet of `nx` columns with a slit of half-length `a` and an area
/// stiffness `k_area`.
fn opening(nx: i64, a: f64, prestrain: f64, k_area: f64, scale: f64) -> f64 {
    let sheet = Sheet::new(nx).cut(a);
    let count = sheet.positions.len();
    let rest_length = scale / (1.0 + prestrain);
    let rest_area = 3f64.sqrt() / 4.0 * rest_length * rest_length;
    let inverse_masses: Vec<f64> = sheet.held.iter().map(|&held| if held { 0.0 } else { 1.0 }).collect();
    let start = scaled(&sheet.positions, scale);
    let lengths = vec![[rest_length]; sheet.springs.len()];
    let groups = greedy(&sheet.springs, count).unwrap();
    let mut builder = SystemBuilder::<f64>::new(&start, &inverse_masses)
        .unwrap()
        .add::<Distance, 2>(&sheet.springs, &lengths, Stiffness::compliance(1.0), &groups)
        .unwrap();
    if k_area > 0.0 {
        let areas = vec![[rest_area, 0.0]; sheet.triangles.len()];
        let compliance = Stiffness::compliance(scale * scale / k_area);
        let groups = greedy(&sheet.triangles, count).unwrap();
        builder = builder.add::<SkinTension, 3>(&sheet.triangles, &areas, compliance, &groups).unwrap();
    }
    let problem = Problem::of(&builder.build(), [0.0; 3]).unwrap();
    let rest = problem.equilibrium(&start, &Options::default()).unwrap();
    assert!(rest.gradient <= 1e-10, "{}", rest.gradient);
    sheet.opening(&scaled(&rest.positions, 1.0 / scale))
}

fn check(found: f64, expected: f64) -> Result<(), String> {
    let error = (found - expected).abs();
    if error <= DIGITS { Ok(()) } else { Err(format!("{found} instead of {expected}: off by {error:e}")) }
}

#[test]
fn small_sheet_at_every_scale() {
    for scale in SCALES {
        check(opening(60, 6.0, PRESTRAIN, 0.0, scale), 0.06741).unwrap();
    }
}

#[test]
fn middle_sheet_with_and_without_area_stiffness() {
    for (k_area, expected) in [(0.0, 0.13450), (1.0, 0.17734), (5.0, 0.33497)] {
        check(opening(120, 12.0, PRESTRAIN, k_area, 1.0), expected).unwrap();
    }
}

#[test]
fn large_sheet() {
    check(opening(200, 10.0, PRESTRAIN, 0.0, 1.0), 0.11773).unwrap();
}

#[test]
fn control_another_prestrain_is_refused() {
    check(opening(60, 6.0, PRESTRAIN * 1.001, 0.0, 1.0), 0.06741).unwrap_err();
}
