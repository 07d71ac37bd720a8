//! `cargo xtask lines`: counts the lines of each tree and language, and compares them with a
//! revision.

use std::collections::BTreeMap;

use anyhow::{Context, Result, bail};

use crate::workspace::Workspace;

/// The top-level folders in the order of the table. Other files belong to `TOP`.
const TREES: [&str; 7] = ["crates", "shaders", "tests", "studies", "xtask", "docs", TOP];
const TOP: &str = "(top)";

/// Languages with the extension of their files.
const LANGUAGES: [(&str, &str); 4] = [("Rust", "rs"), ("WGSL", "wgsl"), ("Python", "py"), ("Markdown", "md")];

/// Lines by tree and language.
type Counts = BTreeMap<(&'static str, &'static str), i64>;

/// Prints the table of the checkout, next to that of `revision` if there is one.
pub fn run(workspace: &Workspace, revision: Option<&str>) -> Result<()> {
    let now = counts(&grep(workspace, None)?, None);
    let before = revision
        .map(|revision| Ok::<_, anyhow::Error>(counts(&grep(workspace, Some(revision))?, Some(revision))));
    print!("{}", table(&now, before.transpose()?.as_ref()));
    Ok(())
}

/// `git grep` prints the number of lines of every file that git does not ignore.
fn grep(workspace: &Workspace, revision: Option<&str>) -> Result<String> {
    let mut command = workspace.command("git");
    command.args(["grep", "-I", "--count", "-e", ""]);
    command.arg(revision.unwrap_or("--untracked")).arg("--");
    command.args(LANGUAGES.map(|(_, extension)| format!("*.{extension}")));
    let output = command.output().context("cannot start git")?;
    if !output.status.success() {
        bail!("git cannot count lines: {}", String::from_utf8_lossy(&output.stderr).trim());
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Sums the lines `PATH:COUNT`, or `REVISION:PATH:COUNT`, of `git grep`.
fn counts(output: &str, revision: Option<&str>) -> Counts {
    let mut counts = Counts::new();
    for line in output.lines() {
        let line =
            revision.map_or(line, |revision| line.strip_prefix(revision).map_or(line, |rest| &rest[1..]));
        let Some((path, count)) = line.rsplit_once(':') else { continue };
        let folder = path.split_once('/').map_or(TOP, |(folder, _)| folder);
        let tree = TREES.into_iter().find(|tree| *tree == folder).unwrap_or(TOP);
        let extension = path.rsplit('.').next();
        let language = LANGUAGES.into_iter().find(|(_, known)| Some(*known) == extension);
        if let (Some((language, _)), Ok(count)) = (language, count.parse::<i64>()) {
            *counts.entry((tree, language)).or_default() += count;
        }
    }
    counts
}

/// One row per tree with a column per language. With `before` each cell also shows the difference.
fn table(now: &Counts, before: Option<&Counts>) -> String {
    let cell = |text: String| format!("{text:>16}");
    let sum = |counts: &Counts, tree: Option<&str>, language: &str| -> i64 {
        let rows = counts
            .iter()
            .filter(|((row, column), _)| tree.is_none_or(|tree| tree == *row) && *column == language);
        rows.map(|(_, count)| count).sum()
    };
    let mut text =
        format!("{:<8}", "") + &LANGUAGES.map(|(language, _)| cell(language.to_owned())).concat() + "\n";
    for tree in TREES.into_iter().map(Some).chain([None]) {
        text += &format!("{:<8}", tree.unwrap_or("total"));
        for (language, _) in LANGUAGES {
            let count = sum(now, tree, language);
            let difference = before.map(|before| format!(" ({:+})", count - sum(before, tree, language)));
            text += &cell(format!("{count}{}", difference.unwrap_or_default()));
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: &str =
        "crates/a/src/lib.rs:10\ncrates/a/src/b.rs:5\nREADME.md:7\nfixtures/x.py:2\ntests/a.txt:9\n";

    #[test]
    fn lines_are_summed_by_tree_and_language() {
        let found = counts(NOW, None);
        let expected = [((TOP, "Markdown"), 7), ((TOP, "Python"), 2), (("crates", "Rust"), 15)];
        assert_eq!(found, Counts::from(expected));
    }

    #[test]
    fn a_revision_is_not_part_of_the_path() {
        assert_eq!(
            counts("main~2:crates/a/src/lib.rs:10\n", Some("main~2")),
            Counts::from([(("crates", "Rust"), 10)])
        );
    }

    #[test]
    fn the_table_shows_differences_and_totals() {
        let before = Counts::from([(("crates", "Rust"), 20), (("studies", "Rust"), 1)]);
        let text = table(&counts(NOW, None), Some(&before));
        let row = |name: &str| text.lines().find(|line| line.starts_with(name)).unwrap();
        assert!(row("crates").contains("15 (-5)"), "{text}");
        assert!(row("studies").contains("0 (-1)"), "{text}");
        assert!(row("total").contains("15 (-6)") && row("total").contains("7 (+7)"), "{text}");
        assert!(!table(&before, None).contains('+'));
    }
}
