//! Cuts of no width: nothing is removed, the wound begins closed, and tension opens it.

use cutis::Scene;

use crate::identity::original;
use crate::outputs::vtu::Vtu;
use crate::scenes::{Run, SMALL, overrides, scene};

const CUT: (&str, &str) =
    ("incision", "[{ from_mm = [30.3, 110, -50], to_mm = [30.3, 110, 50], depth_mm = 20 }]");
const TISSUE: &str = "distance = { youngs_modulus_pa = 2e4 }, volume = { bulk_modulus_pa = 1e5 }";
const REST: [(&str, &str); 2] = [("scan_is_at_rest", "true"), ("run.frames", "3")];
const FILES: (&str, &str) = ("output", "{ volume = true, surface = true, tissue = true, report = true }");

/// Without tension the cut body is the body of the scan, voxel for voxel, on any lattice. Control:
/// a cut with a width removes tissue.
#[test]
fn a_cut_without_tension_changes_no_voxel() {
    let constraints = format!("{{ {TISSUE} }}");
    let cut = |set: &[(&str, &str)]| {
        let own = [CUT, FILES, ("constraints", constraints.as_str())];
        Run::of(&scene(SMALL, &[&REST[..], &own, set].concat()))
    };
    let zone = "{ min_mm = [-40, 40, -90], max_mm = [100, 200, 90] }";
    let lattices: [&[(&str, &str)]; 4] = [
        &[],
        &[("lattice.split", "five")],
        &[("lattice.region", zone)],
        &[("lattice.grading", zone), ("solver.formulation", "vbd")],
    ];
    for lattice in lattices {
        let run = cut(lattice);
        assert_eq!(run.report.max_displacement_mm, 0.0, "{lattice:?}");
        assert!(run.deformed().voxels() == original().voxels(), "{lattice:?}");
        let wound = run.report.wound.clone().unwrap();
        assert!(wound.initial_mm.abs() < 1e-6 && wound.final_mm == wound.initial_mm, "{wound:?}");
        assert_eq!(run.report.sizes.removed_vertices, 0);
    }
    let width = "[{ from_mm = [30.3, 110, -50], to_mm = [30.3, 110, 50], depth_mm = 20, width_mm = 7 }]";
    assert!(cut(&[("incision", width)]).deformed().voxels() != original().voxels());
}

/// Tension opens the cut, with the membrane and with the area form, in each formulation.
#[test]
fn tension_opens_a_closed_cut() {
    let membrane = format!("{{ {TISSUE}, membrane = {{ preset = 'trunk' }} }}");
    let area = format!(
        "{{ {TISSUE}, stc = {{ area_modulus_n_per_m = 60, amplification = 0.0, rest_area_scale = 0.85 }} }}"
    );
    for constraints in [&membrane, &area] {
        for formulation in ["xpbd", "vbd"] {
            let own = [
                CUT,
                ("constraints", constraints.as_str()),
                ("solver.formulation", formulation),
                ("run.frames", "12"),
                ("output", "{ report = true }"),
            ];
            let wound = Run::of(&scene(SMALL, &[&REST[..], &own].concat())).report.wound.unwrap();
            assert!(wound.initial_mm.abs() < 1e-6, "{formulation}: {wound:?}");
            assert!(wound.final_mm > 2.0 && wound.mid_mm > wound.final_mm, "{formulation}: {wound:?}");
        }
    }
}

/// The skin of a region of interest, with the skin around it, has the lines of the whole body.
#[test]
fn a_cut_in_a_region_has_the_skin_of_the_whole_body() {
    let constraints = format!("{{ {TISSUE}, membrane = {{ preset = 'trunk' }} }}");
    let skin = |set: &[(&str, &str)]| {
        let own = [
            CUT,
            ("constraints", constraints.as_str()),
            ("run.frames", "1"),
            ("output", "{ surface = true }"),
        ];
        Vtu::of_bytes(&Run::of(&scene(SMALL, &[&REST[..], &own, set].concat())).bytes("skin.vtu"))
    };
    let [part, whole] = [skin(&[("lattice.region", "{ around_mm = 40.0 }")]), skin(&[])];
    assert_eq!(part.cells.len(), whole.cells.len());
    assert_eq!(part.points.len(), whole.points.len());
    let sum = |mesh: &Vtu, name: &str| mesh.cell_scalars(name).iter().sum::<f64>();
    for name in ["scan_line_weight", "scan_tension_along_n_per_m"] {
        assert!((sum(&part, name) / sum(&whole, name) - 1.0).abs() < 1e-6, "{name}");
    }
}

/// Two cuts that cross are one wound with four corners.
#[test]
fn cuts_that_cross_open_together() {
    let cross = "[{ from_mm = [30.3, 110, -50], to_mm = [30.3, 110, 50], depth_mm = 20 }, \
                  { from_mm = [0, 112, 2], to_mm = [60, 108, 2], depth_mm = 20 }]";
    let constraints = format!("{{ {TISSUE}, membrane = {{ preset = 'trunk' }} }}");
    let set = [
        ("incision", cross),
        ("constraints", constraints.as_str()),
        ("solver.formulation", "vbd"),
        ("run.frames", "12"),
        ("output", "{ report = true, volume = true }"),
    ];
    let run = Run::of(&scene(SMALL, &[&REST[..], &set].concat()));
    assert_eq!(run.report.wounds.len(), 2);
    for wound in &run.report.wounds {
        assert!(wound.initial_mm.abs() < 1e-6 && wound.final_mm > 1.0, "{wound:?}");
    }
}

/// The opening does not depend on where the blade lies within its cells of 4 mm, in ten places.
/// Near 30.4 mm it comes close to lattice points, so that parts of tetrahedra are thin. The body is
/// not the same everywhere: two cuts that lie alike in their cells, at 30 and 34 mm, differ by 2 %.
/// Openings are relative to the line through these two. Control: a cut of half the depth.
#[test]
fn the_opening_does_not_depend_on_the_place_within_a_cell() {
    let opening = |x: f64, depth_mm: f64| {
        let cut = format!("[{{ from_mm = [{x}, 110, -30], to_mm = [{x}, 110, 30], depth_mm = {depth_mm} }}]");
        let set = [
            ("incision", cut.as_str()),
            ("lattice.region", "{ around_mm = 30 }"),
            ("run.frames", "30"),
            ("output", "{ report = true }"),
        ];
        Run::of(&scene("demo.toml", &set)).report.wound.unwrap().final_mm
    };
    let [first, next] = [30.0, 34.0].map(|x| opening(x, 20.0));
    assert!((next / first - 1.0).abs() < 0.03, "{first} and {next}");
    let relative = |n: u32, depth_mm: f64| {
        let share = 0.1 * f64::from(n);
        opening(30.0 + 4.0 * share, depth_mm) / (first + (next - first) * share)
    };
    let openings: Vec<f64> = (0..10).map(|n| relative(n, 20.0)).collect();
    let mean = openings.iter().sum::<f64>() / 10.0;
    assert!(openings.iter().all(|opening| (opening / mean - 1.0).abs() < 0.02), "{openings:?}");
    let shallow = relative(0, 10.0);
    assert!((shallow / mean - 1.0).abs() > 0.02, "{shallow} and {mean}");
}

/// A cut that is smaller than a cell cuts nothing, in both models.
#[test]
fn cuts_that_are_not_possible_are_refused() {
    let refused = |set: &[(&str, &str)]| {
        let folder = tempfile::tempdir().unwrap();
        let loaded = Scene::load(&crate::scenes::folder().join(SMALL), &overrides(set));
        let run = |loaded| crate::scenes::run_in(folder.path(), &loaded, false);
        let error = loaded.and_then(run).unwrap_err();
        assert!(error.is_bad_input(), "{error}");
        error.to_string()
    };
    let short = "[{ from_mm = [30.3, 110, 1], to_mm = [30.3, 110, 1.1], depth_mm = 0.1 }]";
    for model in ["pbd", "chainmail"] {
        let set = [("incision", short), ("model", model), ("constraints", "{}")];
        assert!(refused(&set).contains("incision 0"), "a cut of 0.1 mm with {model}");
    }
}
