//! The opening of cuts of no width: the equilibrium that Newton's method finds without the solver's
//! code, and how it depends on depth, length, tension and direction.

use cutis::{LoadedScene, build_system};
use cutis_newton::{Options, Problem};

use crate::scenes::{Run, SMALL, scene};

/// A cut on the belly of the small phantom, and its skin.
#[derive(Clone, Copy)]
struct Cut {
    /// Lattice step, mm.
    step_mm: f64,
    half_length_mm: f64,
    depth_mm: f64,
    /// Tension along and across the lines, N/m.
    tension: [f64; 2],
    /// Axis of the lines: around the trunk (across the cut), or along it.
    lines: &'static str,
}

const CUT: Cut =
    Cut { step_mm: 7.0, half_length_mm: 50.0, depth_mm: 20.0, tension: [6.0, 2.0], lines: "around" };

impl Cut {
    fn scene(&self, keys: &str, set: &[(&str, &str)]) -> LoadedScene {
        let Self { step_mm, half_length_mm, depth_mm, tension: [along, across], lines } = self;
        let incision = format!(
            "[{{ from_mm = [30.3, 110, -{half_length_mm}], to_mm = [30.3, 110, {half_length_mm}], \
             depth_mm = {depth_mm}{keys} }}]"
        );
        let constraints = format!(
            "{{ distance = {{ youngs_modulus_pa = 5e3 }}, volume = {{ bulk_modulus_pa = 2.5e4 }}, membrane = \
             {{ tension_along_n_per_m = {along}, tension_across_n_per_m = {across}, modulus_along_n_per_m = \
             60, modulus_across_n_per_m = 60, directions = {{ {lines} = [0, 0, 1] }} }} }}"
        );
        let step_mm = step_mm.to_string();
        let own = [
            ("scan_is_at_rest", "true"),
            ("lattice.split", "five"),
            ("lattice.spacing_mm", step_mm.as_str()),
            ("lattice.region", "{ around_mm = 50 }"),
            ("incision", incision.as_str()),
            ("constraints", constraints.as_str()),
            ("solver.formulation", "vbd"),
            ("solver.substeps", "2"),
            ("solver.iterations", "2"),
            ("output", "{ report = true }"),
        ];
        scene(SMALL, &[&own[..], set].concat())
    }

    /// Opening in the middle at the equilibrium that Newton's method finds, mm.
    fn opening(&self) -> f64 {
        let built = build_system(&self.scene("", &[])).unwrap();
        let problem = Problem::of(&built.system, [0.0; 3]).unwrap();
        let options = Options { tolerance: 1e-6, ..Options::default() };
        let after = problem.equilibrium(problem.positions(), &options).unwrap().positions;
        built.gapes[0].measure_by(&|v| after[v as usize]).mid_mm
    }

    /// Opening in the middle at the end of a run, mm. `keys` are further keys of the incision.
    fn opening_of_run(&self, keys: &str) -> f64 {
        Run::of(&self.scene(keys, &[("run.frames", "300")])).report.wound.unwrap().mid_mm
    }
}

/// A run ends at the opening of the equilibrium, whether the cut was there from the start or grew.
/// Control: a skin whose tension is a twentieth higher.
#[test]
fn a_run_ends_at_newtons_equilibrium() {
    let newton = CUT.opening();
    for keys in ["", ", at_s = 0.1, speed_mm_s = 200.0"] {
        let run = CUT.opening_of_run(keys);
        assert!((run / newton - 1.0).abs() < 0.01, "{keys}: {run} mm, Newton's method: {newton} mm");
    }
    let other = Cut { tension: CUT.tension.map(|tension| 1.05 * tension), ..CUT }.opening();
    assert!((other / newton - 1.0).abs() > 0.01, "{other} and {newton}");
}

/// A deeper and a longer cut opens more, and by less and less. A shallow cut is held by the tissue
/// below it. With a step of 7 mm a cut of 20 mm would be as deep as three steps, and the depth of
/// its floor would differ too much between cuts.
#[test]
fn deeper_and_longer_cuts_open_more() {
    let fine = Cut { step_mm: 5.0, ..CUT };
    let by_depth = [8.0, 14.0, 20.0, 26.0].map(|depth_mm| Cut { depth_mm, ..fine }.opening());
    assert!(by_depth.is_sorted_by(|a, b| 1.01 * a < *b), "{by_depth:?}");
    let by_length = [15.0, 25.0, 35.0, 50.0].map(|half_length_mm| Cut { half_length_mm, ..fine }.opening());
    assert!(by_length.is_sorted_by(|a, b| 1.01 * a < *b), "{by_length:?}");
    // In a free sheet the opening is proportional to the length. Tissue below holds long cuts.
    assert!(by_length[3] / by_length[0] < 50.0 / 15.0, "{by_length:?}");
}

/// The opening grows with the tension across the cut, and in proportion to it while strains are
/// small. The tension along the cut counts little.
#[test]
fn more_tension_across_the_cut_opens_it_more() {
    let with = |tension| Cut { tension, ..CUT }.opening();
    let small = [0.1, 0.2, 0.4].map(|along| with([along, 0.1]));
    for (n, opening) in small.iter().enumerate() {
        let expected = small[0] * f64::from(1 << n);
        assert!((opening / expected - 1.0).abs() < 0.03, "{small:?}");
    }
    let large = [6.0, 12.0, 24.0].map(|along| with([along, 2.0]));
    assert!(large.is_sorted_by(|a, b| 1.2 * a < *b), "{large:?}");
    let [few, much] = [0.1, 0.3].map(|across| with([0.3, across]));
    assert!((much / few - 1.0).abs() < 0.1, "{few} and {much}");
}

/// A cut across the lines of tension opens as much more than one along them as the tensions differ.
#[test]
fn cuts_across_the_lines_open_more() {
    let tension = [0.3, 0.1];
    let across = Cut { tension, ..CUT }.opening();
    let along = Cut { tension, lines: "along", ..CUT }.opening();
    assert!((across / along / 3.0 - 1.0).abs() < 0.1, "{across} and {along}");
}
