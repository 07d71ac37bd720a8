//! Completions, man pages and the page of commands describe every command and option.

use std::process::{Command, Stdio};

use crate::Desk;

/// The commands that `cutis --help` lists.
fn commands(desk: &Desk) -> Vec<String> {
    let help = desk.cutis(&["--help"]).expect_success().stdout;
    let listed = help.split("Commands:").nth(1).unwrap().split("Options:").next().unwrap();
    let lines = listed.lines().filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    let names = lines.filter_map(|line| line.split_whitespace().next()).filter(|name| *name != "help");
    let names: Vec<String> = names.map(str::to_owned).collect();
    assert!(names.len() > 12 && names.contains(&"sweep".to_owned()), "{names:?}");
    names
}

#[test]
fn completions_name_every_command_for_every_shell() {
    let desk = Desk::new();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = desk.cutis(&["completions", shell]).expect_success().stdout;
        for name in commands(&desk) {
            assert!(script.contains(&name), "{shell}: {name}");
        }
        assert!(script.contains("--dry-run") || script.contains("dry-run"), "{shell}");
    }
    assert_eq!(desk.cutis(&["completions", "csh"]).code, 2);
}

/// bash itself completes: a word that only `sweep` begins with, and an option.
#[test]
#[cfg(unix)]
fn bash_completes_commands_and_options() {
    let desk = Desk::new();
    let completed = |words: &str| {
        let script = format!(
            "source <($cutis completions bash); COMP_WORDS=({words}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); \
             _cutis cutis \"${{COMP_WORDS[-1]}}\" \"${{COMP_WORDS[-2]}}\"; echo \"${{COMPREPLY[@]}}\""
        );
        desk.script(&script).expect_success().stdout.trim().to_owned()
    };
    assert_eq!(completed("cutis swe"), "sweep");
    assert_eq!(completed("cutis sweep study.toml --dry"), "--dry-run");
    assert_eq!(completed("cutis unheard"), "");
}

#[test]
fn there_is_a_man_page_for_every_command() {
    let desk = Desk::new();
    desk.cutis(&["man", "pages"]).expect_success();
    let names = desk.names("pages");
    assert!(
        names.contains(&"cutis.1".to_owned()) && names.contains(&"cutis-scene-new.1".to_owned()),
        "{names:?}"
    );
    for name in commands(&desk) {
        let page = std::fs::read_to_string(desk.path(&format!("pages/cutis-{name}.1"))).unwrap();
        assert!(page.starts_with(".ie") && page.contains(".SH SYNOPSIS"), "{name}");
    }
    let page = std::fs::read_to_string(desk.path("pages/cutis-sweep.1")).unwrap();
    let plain = page.replace("\\-", "-").replace("\\fB", "").replace("\\fR", "");
    for option in ["--jobs", "--dry-run", "--case"] {
        assert!(plain.contains(option), "{option}: {plain}");
    }
    desk.cutis(&["man", "scene.toml"]).expect_error(1, &["scene.toml"]);
    assert_eq!(desk.cutis(&["man"]).code, 2);
}

/// A program that knows the format finds nothing wrong, if there is one.
#[test]
#[cfg(unix)]
fn man_pages_have_no_warnings() {
    let has = |program: &str| Command::new(program).arg("--version").stdout(Stdio::null()).status().is_ok();
    if !has("groff") {
        eprintln!("skipped: there is no groff");
        return;
    }
    let desk = Desk::new();
    desk.cutis(&["man", "pages"]).expect_success();
    let done = desk.script("groff -man -ww -z pages/*.1").expect_success();
    assert_eq!(done.stderr, "");
}

#[test]
fn the_page_of_commands_is_up_to_date() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/book/commands.md");
    let written = std::fs::read_to_string(page).unwrap();
    let printed = Desk::new().cutis(&["man", "--markdown"]).expect_success().stdout;
    assert!(written == printed, "write it with `cargo run -- man --markdown > docs/book/commands.md`");
}
