//! The steps of a scene as the program lists them, and steps that are not possible.

use crate::Desk;

/// A square of skin on the belly. Its size is that of the diagonal, and the opening across it.
const SQUARE: &str = "[[-15, 103, -15], [15, 103, -15], [15, 103, 15], [-15, 103, 15], [-15, 103, -15]]";

/// A scene whose piece is excised, undermined and sewn.
fn operated() -> Desk {
    let desk = Desk::new();
    let scene = std::fs::read_to_string(desk.path("scene.toml")).unwrap();
    let scene = scene.lines().filter(|line| !line.starts_with("incision") && !line.starts_with("stc"));
    let steps = format!(
        "
[[step]]
kind = 'excise'
name = 'lesion'
path_mm = {SQUARE}
depth_mm = 24
[[step]]
kind = 'undermine'
wound = 'lesion'
distance_mm = 30
depth_mm = 18
at_s = 0.01
[[step]]
kind = 'suture'
wound = 'lesion'
every_mm = 10
bite_mm = 8
at_s = 0.02
"
    );
    desk.put("steps.toml", scene.collect::<Vec<_>>().join("\n") + &steps);
    desk
}

#[test]
fn check_lists_the_steps_with_their_sizes() {
    let desk = operated();
    let printed = desk.cutis(&["check", "steps.toml"]).expect_success().stdout;
    for words in ["excision[0]", "42.4 × ", "undermining[0]", "suture[0]", "0.02"] {
        assert!(printed.contains(words), "no {words:?} in: {printed}");
    }
    assert!(!printed.contains("constraints.contact has no effect"), "an undermining has lips: {printed}");
    let json = desk.cutis(&["check", "steps.toml", "--json"]).expect_success().stdout;
    let plan: serde_json::Value = serde_json::from_str(&json).unwrap();
    let sections = plan["steps"].as_array().unwrap().iter().map(|step| step["section"].as_str().unwrap());
    assert_eq!(sections.collect::<Vec<_>>(), ["excision[0]", "undermining[0]", "suture[0]"]);
    // Control: a scene without steps has none in its list.
    let none = desk.cutis(&["check", "scene.toml", "--json"]).expect_success().stdout;
    let none: serde_json::Value = serde_json::from_str(&none).unwrap();
    assert!(none["steps"].as_array().is_none_or(|steps| steps.len() == 1), "{none}");
}

/// `check` and `run` refuse a step that is not possible, name its key, and write nothing.
#[test]
fn steps_that_are_not_possible_end_with_two() {
    let desk = operated();
    let path = |points: &str| format!("step.0.path_mm={points}");
    let cases = [
        (path("[[-15, 303, -15], [15, 303, -15], [15, 303, 15], [-15, 303, -15]]"), "from the skin"),
        (
            path("[[-15, 103, -15], [15, 103, 15], [15, 103, -15], [-15, 103, 15], [-15, 103, -15]]"),
            "lattice step",
        ),
        (path("[[0, 103, 0], [0, 103, 0]]"), "path_mm"),
        (path("[[-15, 103, -15], [15, 103, -15], [15, 103, 15]]"), "closed outline"),
        ("step.1.wound='other'".to_owned(), "other"),
        ("step.2.pairs_mm=[[[60, 97, 0], [75, 94, 0]]]".to_owned(), "not both"),
    ];
    for (change, words) in &cases {
        for command in [&["check"][..], &["run", "--out", "run"]] {
            let call = [command, &["steps.toml", "--set", change.as_str()]].concat();
            desk.cutis(&call).expect_error(2, &["steps.toml", "step[", words]);
        }
    }
    assert!(desk.names("run").is_empty());
}
