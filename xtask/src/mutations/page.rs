//! The page about mutations: a section for each suite, which says at which commit it was run. A run of one suite leaves the other sections
//! as they are.

use std::path::Path;

use anyhow::{Context, Result};

use super::list::{Mutation, Suite};

/// Names of tests that stand in the table for one fault; the others are counted.
const NAMED: usize = 2;

const HEAD: &str = "# Mutations\n\n\
    Faults, put in one at a time; each made at least one test fail. Without a fault all tests of its suite passed in the same run. Written by\n\
    `cargo xtask mutations`, which runs all, or with `--suite NAME` one section; each says at which commit it was run. The lists are\n\
    in `xtask/src/mutations/`.\n";

/// The section of a suite.
pub struct Section {
    suite: Suite,
    text: String,
}

impl Section {
    /// All faults of a suite, as rows.
    pub fn new(suite: Suite, rows: &[String], commit: &str, adapters: &str) -> Self {
        let (heading, count) = (heading(suite), rows.len());
        let text = format!(
            "{heading}\n{count} faults, at commit {commit}; adapters: {adapters}.\n\n\
             | | fault | change | seen by |\n|---|---|---|---|\n{}\n",
            rows.join("\n")
        );
        Self { suite, text }
    }
}

/// The page with these sections in place of what it had of their suites.
pub fn with(page: &str, sections: &[Section]) -> Result<String> {
    let mut text = HEAD.to_owned();
    for suite in Suite::ALL {
        let section = match sections.iter().find(|section| section.suite == suite) {
            Some(section) => &section.text,
            None => of(page, suite).with_context(|| {
                format!("the page has no section `{}`: run `cargo xtask mutations`", suite.name())
            })?,
        };
        text = text + "\n" + section;
    }
    Ok(text)
}

/// What the page says of a suite.
fn of(page: &str, suite: Suite) -> Option<&str> {
    let start = page.find(&heading(suite))?;
    let section = &page[start..];
    Some(section.find("\n\n## ").map_or(section, |end| &section[..=end]))
}

fn heading(suite: Suite) -> String {
    format!("## {}\n", suite.name())
}

/// The row of a fault, and of the tests that it made fail.
pub fn row(number: usize, mutation: &Mutation, failed: &[String]) -> String {
    let names: Vec<String> = failed.iter().take(NAMED).map(|name| format!("`{name}`")).collect();
    let more = match failed.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|");
    let code = |text: &str| match words(text) {
        words if words.is_empty() => "nothing".to_owned(),
        words => format!("`{words}`"),
    };
    let file = Path::new(mutation.file).file_name().unwrap_or_default().to_string_lossy();
    let (fault, from, to) = (mutation.fault, code(mutation.from), code(mutation.to));
    format!("| {number} | {fault} | {file}: {from} → {to} | {}{more} |", names.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn section(suite: Suite, row: &str, commit: &str) -> Section {
        Section::new(suite, &[row.to_owned()], commit, "card (driver 1.0)")
    }

    #[test]
    fn a_suite_that_is_run_again_leaves_the_others_as_they_are() {
        let all = Suite::ALL.map(|suite| section(suite, &format!("| 1 | of {} |", suite.name()), "0123abc"));
        let first = with("", &all).unwrap();
        assert_eq!(first.matches("1 faults, at commit 0123abc; adapters: card (driver 1.0).").count(), 6);
        assert_eq!(with(&first, &[]).unwrap(), first);
        for suite in Suite::ALL {
            let again = with(&first, &[section(suite, "| 1 | new |", "fedc987")]).unwrap();
            let old = format!("| 1 | of {} |", suite.name());
            assert_eq!(again, {
                let start = first.find(&heading(suite)).unwrap();
                let (head, rest) = first.split_at(start);
                let changed = rest.replacen("0123abc", "fedc987", 1).replacen(&old, "| 1 | new |", 1);
                head.to_owned() + &changed
            });
        }
    }

    #[test]
    fn a_section_that_was_never_written_is_missed() {
        let error = with("", &[section(Suite::Solver, "| 1 |", "0")]).unwrap_err();
        assert!(error.to_string().contains("`conformance`"), "{error}");
    }

    #[test]
    fn what_is_taken_away_becomes_nothing() {
        let mutation =
            Mutation { fault: "gone", file: "a/b.rs", from: "x |\n  y", to: "", suite: Suite::Solver };
        let names = ["a", "b", "c"].map(str::to_owned);
        assert_eq!(
            row(3, &mutation, &names),
            "| 3 | gone | b.rs: `x \\| y` → nothing | `a`, `b` and 1 more |"
        );
    }
}
