//! Costs, messages and absent parts of each model.

use cutis::chainmail::{Chain, Material};
use cutis::{Plan, Silent};
use serde_json::Value;

use super::*;

fn plan(set: &[(&str, &str)]) -> Plan {
    cutis::check(&chain(set), &Silent).unwrap()
}

fn warns(plan: &Plan, words: &str) -> bool {
    plan.warnings.iter().any(|line| line.contains(words))
}

#[test]
fn a_chain_needs_only_its_own_memory() {
    let plan = plan(&[HANDLE, ("solver.backend", "auto")]);
    let count = POINTS.iter().product();
    let bytes = Chain::new(POINTS, [1.0; 3], &[Material::RIGID], vec![0; count]).unwrap().bytes();
    let parts: Vec<(&str, usize)> = plan.memory.iter().map(|part| (part.part.as_str(), part.bytes)).collect();
    assert_eq!(parts, bytes);
    assert!(plan.colors.is_empty() && plan.device_memory.is_empty());
    let twin = Twin::of(&chain(&[HANDLE]));
    let still = twin.still.iter().filter(|still| **still).count();
    assert_eq!(
        (plan.sizes.lattice, plan.sizes.vertices, plan.sizes.edges, plan.sizes.fixed_vertices),
        (POINTS, twin.rest.len(), twin.links.len(), still)
    );
    assert_eq!(plan.projections, 6 * 10 * twin.rest.len() as u64);
    assert_eq!(plan.backend.name, "cpu");
    assert!(plan.backend.reason.contains("ChainMail propagates on the CPU"), "{}", plan.backend.reason);
    let says = |topic: &str| plan.left_out.iter().any(|line| line.starts_with(&format!("{topic}:")));
    assert!(
        says("solver") && says("incision") && !says("handle") && !says("relaxation"),
        "{:?}",
        plan.left_out
    );
    assert_eq!(plan.warnings, [""; 0]);
}

#[test]
fn missing_relaxation_is_reported() {
    let plan = plan(&[UNRELAXED]);
    assert!(plan.left_out.iter().any(|line| line.starts_with("relaxation:")) && plan.projections == 0);
}

/// The run ends before the handle arrives, with either model. Another scene has nothing that moves
/// the body.
#[test]
fn unfinished_movements_cause_a_warning() {
    let over = |over_s| [HANDLE, ("handle.0.over_s", over_s)];
    for model in ["chainmail", "pbd"] {
        let of = |over_s| {
            let spring = ("constraints", "{ distance = { youngs_modulus_pa = 5e3 } }");
            cutis::check(&chain(&[&over(over_s)[..], &[spring, ("model", model)]].concat()), &Silent).unwrap()
        };
        // The run has six frames of an eighth of a second.
        assert!(warns(&of("3"), "handle[0] comes 25.000 % of its way"), "{:?}", of("3").warnings);
        assert!(!warns(&of("0.75"), "of its way"));
    }
    assert!(warns(&plan(&[]), "there is no handle") && !warns(&plan(&[HANDLE]), "there is no handle"));
}

#[test]
fn a_section_of_the_other_model_causes_a_warning() {
    let spring = ("constraints", "{ distance = { youngs_modulus_pa = 5e3 } }");
    let gravity = ("solver.gravity_m_s2", "[0, 0, -9.81]");
    let with = plan(&[spring, gravity]);
    assert!(warns(&with, "constraints have no effect") && warns(&with, "gravity_m_s2 has no effect"));
    assert!(!with.memory.iter().any(|part| part.part == "distance"));
    let other = plan(&[spring, ("model", "pbd"), ("chainmail.relax_per_frame", "5")]);
    assert!(warns(&other, "chainmail has no effect"), "{:?}", other.warnings);
    let other = cutis::check(&bare(&[spring, ("model", "pbd")]), &Silent).unwrap();
    assert!(!warns(&other, "chainmail"), "{:?}", other.warnings);
}

#[test]
fn only_the_report_of_a_chain_has_chain_figures() {
    let read = |set: &[(&str, &str)]| -> Value {
        let run = Run::of(&bare(&[&[("output", "{ report = true }"), ("run.frames", "2")], set].concat()));
        serde_json::from_slice(&run.bytes("report.json")).unwrap()
    };
    let (chain, other) = (read(&[]), read(&[("model", "pbd")]));
    let keys =
        |report: &Value| report.get("chainmail").is_some() || report["scene"].get("chainmail").is_some();
    assert!(keys(&chain) && !keys(&other));
    assert_eq!(
        (chain["residuals"].as_array().unwrap().len(), &chain["scene"]["model"]),
        (0, &Value::from("chainmail"))
    );
    // The cost report lists its time by part.
    let parts: Vec<&str> = chain["ledger"]["parts"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(|part| part["part"].as_str())
        .collect();
    assert!(parts.contains(&"coordinates") && parts.contains(&"relaxation"), "{parts:?}");
    assert!(
        !parts.contains(&"propagation") && !parts.contains(&"cuts"),
        "nothing drags and nothing cuts: {parts:?}"
    );
}
