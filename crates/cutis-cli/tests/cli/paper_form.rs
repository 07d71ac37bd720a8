//! `cutis check` lists the paper's form of skin tension under its key.

use serde_json::Value;

use crate::Desk;

#[test]
fn the_cost_report_has_the_colors_of_the_paper_form() {
    let form = [
        "solver.formulation=pbd",
        "constraints.stc.form=paper",
        "constraints.stc.stiffness=0.5",
        "solver.backend=cpu",
    ];
    let set = form.iter().flat_map(|change| ["--set", change]);
    let args: Vec<&str> = ["check", "scene.toml", "--json"].into_iter().chain(set).collect();
    let plan: Value = serde_json::from_str(&Desk::new().cutis(&args).expect_success().stdout).unwrap();
    let parts = plan["ledger"]["parts"].as_array().unwrap();
    let part = parts.iter().find(|part| part["part"] == "stc").unwrap();
    assert!(part["host_bytes"].as_u64() > Some(0) && part["ms_per_frame"].as_f64() > Some(0.0), "{part}");
    assert!(plan["colors"]["stc"].as_u64() > Some(0), "{}", plan["colors"]);
}
