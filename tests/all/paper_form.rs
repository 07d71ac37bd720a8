//! The paper's form of skin tension is the kind `stc` in every report, although the solver has
//! another constraint type for it.

use cutis::constraints::{Constraint, SkinTensionPaper};
use cutis::{LoadedScene, Plan, Silent};

use crate::scenes::{Run, SMALL, scene};

const KINDS: [&str; 3] = ["distance", "volume", "stc"];

/// The small phantom with the paper's form of skin tension.
fn paper(set: &[(&str, &str)]) -> LoadedScene {
    let form = [
        ("solver.formulation", "pbd"),
        ("constraints.stc.form", "paper"),
        ("constraints.stc.stiffness", "0.5"),
        ("lattice.spacing_mm", "12"),
        ("solver.backend", "cpu"),
    ];
    scene(SMALL, &[&form, set].concat())
}

fn plan(set: &[(&str, &str)]) -> Plan {
    cutis::check(&paper(set), &Silent).unwrap()
}

#[test]
fn the_paper_form_has_another_name_in_the_solver() {
    assert_ne!(SkinTensionPaper::NAME, "stc");
}

#[test]
fn parts_and_colors_of_a_plan_have_the_key_of_the_kind() {
    let plan = plan(&[]);
    let memory: Vec<&str> = plan.memory.iter().map(|part| part.part.as_str()).collect();
    assert_eq!(memory, ["vertices", "distance", "volume", "stc"]);
    for kind in KINDS {
        assert!(plan.colors[kind] > 0, "{:?}", plan.colors);
        let part = plan.costs.parts.iter().find(|part| part.part == kind).unwrap();
        assert!(part.host_bytes > 0 && part.ms_per_frame.is_some(), "{part:?}");
    }
    let unknown = |name: &&str| *name == SkinTensionPaper::NAME;
    assert!(!plan.costs.parts.iter().map(|part| part.part.as_str()).any(|name| unknown(&name)));
}

#[test]
fn reports_have_colors_errors_and_cost_of_the_paper_form() {
    let run = Run::of(&paper(&[("run.frames", "2"), ("output", "{ report = true }")]));
    let report = &run.report;
    let kinds: Vec<&str> = report.residuals.iter().map(|residual| residual.kind.as_str()).collect();
    assert_eq!(kinds, KINDS);
    let json: serde_json::Value = serde_json::from_slice(&run.bytes("report.json")).unwrap();
    let colors = json["colors"]["stc"].as_u64().unwrap();
    assert!(colors > 0);
    // The skin is no lattice. Its colors are those of the CPU on every backend.
    let by_kind =
        serde_json::json!({"distance": "closed_form", "volume": "closed_form", "stc": "greedy_cpu"});
    assert_eq!(json["colorings"], by_kind);
    let parts = json["ledger"]["parts"].as_array().unwrap();
    let part = parts.iter().find(|part| part["part"] == "stc").unwrap();
    assert!(part["host_bytes"].as_u64().unwrap() > 0 && part["ms_per_frame"].is_number(), "{part}");
    let html = String::from_utf8(run.bytes("report.html")).unwrap();
    let row = format!("<tr><td>stc</td><td class=\"n\">{colors}</td>");
    assert!(html.contains(&row), "the table of constraints shows the colors of stc");
    assert!(!html.contains(SkinTensionPaper::NAME));
}

/// The line about the region counts the memory of all parts that it leaves out.
#[test]
fn a_region_counts_the_memory_of_the_skin_that_it_leaves_out() {
    // The scene's own lattice: on the coarser one the skin takes less than the line can show.
    let fine = ("lattice.spacing_mm", "9");
    let (whole, region) = (plan(&[fine]), plan(&[fine, ("lattice.region.around_mm", "30")]));
    let line = region.left_out.iter().find(|line| line.starts_with("region:")).unwrap();
    let saved_mb: f64 = {
        let end = line.find(" MB").unwrap();
        let start = line[..end].rfind(' ').unwrap() + 1;
        line[start..end].parse().unwrap()
    };
    let bytes = |plan: &Plan| plan.memory.iter().map(|part| part.bytes).sum::<usize>() as f64;
    let without_skin = |plan: &Plan| {
        let others = plan.memory.iter().filter(|part| part.part != "stc");
        others.map(|part| part.bytes).sum::<usize>() as f64
    };
    let (all, others) =
        (1e-6 * (bytes(&whole) - bytes(&region)), 1e-6 * (without_skin(&whole) - without_skin(&region)));
    // The line has one digit after the point. The tables of colors and the lists of pieces in rows
    // are not in proportion to the elements. Without the skin the line would be off by more.
    assert!(all - others > 0.15, "the test needs a larger skin: {all} {others}");
    let most = 0.5 * (all - others);
    assert!((saved_mb - all).abs() < most, "{saved_mb} of {all}, {others} without skin");
    assert!((saved_mb - (all - others) - all).abs() > most, "control: without the skin");
}
