//! The program of the studies as `cargo xtask study` starts it. This test also makes `cargo test`
//! build the program, which later steps of `cargo xtask test` run.

use std::process::{Command, Output};

fn study(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_study")).args(arguments).output().unwrap()
}

#[test]
fn every_study_explains_its_options() {
    for name in [
        "accuracy",
        "at-rest",
        "cantilever",
        "chainmail",
        "main-job",
        "mutations",
        "parity",
        "patch",
        "peers",
        "region",
        "stability",
        "tuning",
    ] {
        let output = study(&[name, "--help"]);
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success() && text.contains(&format!("cargo xtask study {name}")), "{text}");
    }
}

#[test]
fn a_wrong_option_ends_with_2_and_a_failed_study_with_1() {
    for wrong in [&["accuracy", "--fast"][..], &["stability", "--quick", "--full"], &["everything"], &[]] {
        assert_eq!(study(wrong).status.code(), Some(2), "{wrong:?}");
    }
    assert_eq!(study(&["cantilever"]).status.code(), Some(1));
    assert_eq!(study(&["peers"]).status.code(), Some(1));
    assert_eq!(study(&["parity", "--quick", "--adapter", "no such adapter"]).status.code(), Some(1));
}

#[test]
fn the_rows_of_a_study_are_written_as_json() {
    let path = std::env::temp_dir().join(format!("cutis-studies-{}.json", std::process::id()));
    let file = path.to_string_lossy().into_owned();
    let output =
        study(&["stability", "--quick", "--backend", "cpu", "--json", &file, "everything fixed, XPBD"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = std::fs::read(&path).unwrap();
    std::fs::remove_file(&path).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&text).unwrap();
    let row = &json["rows"][0];
    assert_eq!(json["passed"], true);
    assert_eq!((row["backend"].as_str(), row["outcome"].as_str()), (Some("cpu f32"), Some("settled")));
    assert!(row["case"].as_str().is_some_and(|case| case.starts_with("everything fixed")));
    assert!(json["provenance"]["machine"]["cores"].is_u64());
}
