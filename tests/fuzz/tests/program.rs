//! The program `fuzz`. Because of this test `cargo test` builds it, and the step `fuzz` runs it.

use std::process::{Command, Output};

fn fuzz(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_fuzz")).args(arguments).output().unwrap()
}

#[test]
fn a_short_run_prints_a_row_for_its_reader() {
    let output = fuzz(&["--target", "nrrd", "--seconds", "1"]);
    let printed = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{printed}");
    let rows: Vec<&str> = printed.lines().skip(1).collect();
    assert!(matches!(rows[..], [row] if row.starts_with("nrrd ")), "{printed}");
}

#[test]
fn an_unknown_reader_is_an_error_that_names_the_readers() {
    let output = fuzz(&["--target", "nrd"]);
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1));
    for part in ["--target nrd", "nifti", "nrrd", "markups"] {
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn a_file_without_a_reader_is_an_error() {
    let output = fuzz(&["--input", "scene.toml"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8(output.stderr).unwrap().contains("--input needs --target"));
}
