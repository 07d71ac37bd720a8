//! `report.json`: its numbers compared with counts that these tests make themselves.

use std::collections::BTreeSet;

use sha2::{Digest, Sha256};

use super::body::{HANDLE_MM, STEP_MM, finished, run};
use super::vtu::Vtu;

#[test]
fn element_counts_match_the_meshes() {
    let run = finished();
    let mesh = Vtu::of_bytes(&run.files["tissue.vtu"]);
    let edges: BTreeSet<[usize; 2]> = mesh
        .cells
        .iter()
        .flat_map(|cell| [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]].map(|[a, b]| [cell[a], cell[b]]))
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    assert_eq!(run.number("/sizes/edges"), edges.len() as f64);
    // The CT is 47 × 31 × 49 voxels of 4 mm from the first center to the last.
    let lattice = [47.0, 31.0, 49.0].map(|voxels: f64| (voxels * 4.0 / STEP_MM).round() + 1.0);
    for (axis, expected) in lattice.into_iter().enumerate() {
        assert!((run.number(&format!("/sizes/lattice/{axis}")) - expected).abs() <= 1.0, "axis {axis}");
    }
    // Vertices beyond the plane of the scene, and those that the handle moves.
    let is_held = |(at, by): &(&[f64; 3], [f64; 3])| {
        let rest = [by[0] - at[0], by[1] - at[1], at[2] - by[2]];
        let from_handle: f64 = rest.iter().zip(HANDLE_MM.0).map(|(a, b)| (a - b).powi(2)).sum();
        rest[1] < -30.0 || from_handle.sqrt() < HANDLE_MM.1
    };
    let fixed = mesh.points.iter().zip(mesh.vectors("displacement_mm")).filter(is_held).count() as f64;
    let reported = run.number("/sizes/fixed_vertices");
    assert!((reported / fixed - 1.0).abs() < 0.02, "{reported} fixed vertices, {fixed} in tissue.vtu");
    assert!(run.number("/sizes/removed_vertices") > 10.0);
    for key in ["frozen_vertices", "frozen_tets"] {
        assert_eq!(run.number(&format!("/sizes/{key}")), 0.0, "{key}");
    }
}

/// A closed box without holes: one part, no open edge, and skin on all of the surface.
#[test]
fn the_skin_of_the_block_is_whole() {
    let run = finished();
    for key in ["open_edges", "non_manifold_edges", "enclosed_share"] {
        assert_eq!(run.number(&format!("/skin/{key}")), 0.0, "{key}");
    }
    assert_eq!((run.number("/skin/components"), run.number("/skin/coverage")), (1.0, 1.0));
    assert!(run.number("/skin/triangles") > run.number("/sizes/skin_triangles"), "the incisions remove skin");
}

#[test]
fn the_report_names_its_inputs() {
    let run = finished();
    let inputs = run.report["inputs"].as_array().unwrap();
    assert_eq!((inputs.len(), &inputs[0]["path"]), (2, &"body.toml".into()));
    assert!(inputs[1]["path"].as_str().unwrap().ends_with("ct.nii.gz"), "{}", inputs[1]);
    let digest = Sha256::digest(super::body::ct().to_bytes());
    let hexadecimal: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(inputs[1]["sha256"].as_str(), Some(hexadecimal.as_str()));
    assert_eq!(run.report["scene"]["handle"][0]["radius_mm"].as_f64(), Some(HANDLE_MM.1));
    assert_eq!(run.report["schema"], "cutis-report/1");
    assert_eq!(run.report["backend"]["name"], "cpu");
    assert!(run.report["backend"]["adapter"].is_null());
    assert!(run.number("/backend/threads") >= 1.0 && run.number("/machine/cores") >= 1.0);
}

/// The bytes in the cost report equal those of the memory lists, and each part that was stepped has
/// a time.
#[test]
fn memory_and_costs_agree() {
    let run = finished();
    let memory = run.report["memory"].as_array().unwrap();
    let parts = run.report["ledger"]["parts"].as_array().unwrap();
    for part in memory {
        let cost = parts.iter().find(|cost| cost["part"] == part["part"]).unwrap();
        assert_eq!(cost["host_bytes"], part["bytes"], "{part}");
        assert_eq!(cost["device_bytes"], 0, "{part}");
    }
    let sum: f64 = parts.iter().filter_map(|part| part["ms_per_frame"].as_f64()).sum();
    let mean = run.number("/frames/ms_mean");
    assert!(sum > 0.3 * mean && sum < 1.05 * mean, "parts take {sum} ms of {mean} ms per frame");
    let time = run.report["ledger"]["time"].as_str().unwrap();
    assert!(time.contains("12 frames"), "{time}");
    assert_eq!(run.report["device_memory"].as_array().unwrap().len(), 0);
}

/// Errors of constraints: springs at rest have none, skin under tension has.
#[test]
fn residuals_are_ratios_of_the_right_kind() {
    let still = run(&[
        ("incision", "[]"),
        ("handle", "[]"),
        ("run.frames", "0"),
        ("output", "{ report = true }"),
        ("constraints.stc.rest_area_scale", "0.8"),
    ]);
    let residuals = still.report["residuals"].as_array().unwrap();
    let kinds: Vec<&str> = residuals.iter().map(|r| r["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["distance", "volume", "stc"]);
    for (n, expected) in [0.0, 0.0].into_iter().enumerate() {
        assert!((still.number(&format!("/residuals/{n}/max")) - expected).abs() < 1e-4);
    }
    // Area over rest area is 1/0.8, so that C/A0 = 0.25·√(1 + 2/3·β·0.25) with β = 2.
    let expected = 0.25 * (1.0_f64 + 2.0 / 3.0 * 2.0 * 0.25).sqrt();
    for key in ["rms", "max"] {
        let found = still.number(&format!("/residuals/2/{key}"));
        assert!((found - expected).abs() < 1e-3, "{key}: {found}, not {expected}");
    }
    assert_eq!(still.number("/max_displacement_mm"), 0.0);
    assert_eq!(still.report["wounds"].as_array().unwrap().len(), 0);
    assert!(still.report.get("wound").is_none() && still.report.get("resample").is_none());
    let run = finished();
    for n in 0..3 {
        let [rms, max] = ["rms", "max"].map(|key| run.number(&format!("/residuals/{n}/{key}")));
        assert!(rms > 0.0 && rms < max, "{n}: {rms} and {max}");
    }
}

/// Nothing moves outside a region, and the vertices there are counted separately.
#[test]
fn the_tissue_outside_a_region_is_counted_separately() {
    let run = run(&[
        ("lattice.region", "{ around_mm = 30.0 }"),
        ("incision", "[{ from_mm = [20, 40, -20], to_mm = [20, 40, 60], depth_mm = 15, width_mm = 8 }]"),
        ("output", "{ report = true, tissue = true }"),
    ]);
    let whole = finished();
    let sum = |run: &super::body::Finished, keys: &[&str]| -> f64 {
        keys.iter().map(|key| run.number(&format!("/sizes/{key}"))).sum()
    };
    assert_eq!(sum(&run, &["vertices", "frozen_vertices"]), sum(whole, &["vertices"]));
    assert!(sum(&run, &["frozen_vertices"]) > sum(&run, &["vertices"]));
    assert!(sum(&run, &["frozen_tets"]) > sum(&run, &["tets"]));
    let border = run.number("/border_displacement_mm");
    let largest = run.number("/max_displacement_mm");
    assert!(border > 0.0 && border < 0.8 * largest, "{border} mm at the border, {largest} mm at the most");
    assert!(whole.report.get("border_displacement_mm").is_none());
    assert!((largest - whole.number("/max_displacement_mm")).abs() < 0.1 * largest);
}

/// Lips that pass through each other are reported with their wound and the depth in mm.
#[test]
fn crossed_lips_are_reported_with_their_depth() {
    let run = run(&[
        ("handle", "[{ at_mm = [32, 38, 20], radius_mm = 12, move_mm = [-40, 0, 0], over_s = 0.1 }]"),
        ("output", "{ report = true }"),
    ]);
    let least = run.number("/wounds/0/final_mm").min(run.number("/wounds/0/mid_mm"));
    assert!(least < 0.0, "the lips have not crossed: {:#}", run.report["wounds"]);
    let warnings = run.report["warnings"].as_array().unwrap();
    let crossed: Vec<&str> =
        warnings.iter().filter_map(|w| w.as_str()).filter(|w| w.contains("passed through")).collect();
    assert_eq!(crossed.len(), 1, "{warnings:?}");
    let depth = format!("by {:.2} mm", -least);
    assert!(crossed[0].contains("incision[0]") && crossed[0].contains(&depth), "{crossed:?}, {depth}");
    let html = run.text("report.html");
    assert!(html.contains("passed through each other"), "the page shows warnings");
    assert!(
        finished().report["warnings"]
            .as_array()
            .unwrap()
            .iter()
            .all(|w| { !w.as_str().unwrap().contains("passed through") })
    );
}
