//! `cargo xtask mutations`: faults put in on purpose, one at a time, in a copy of the checkout; each must make a test fail.
//! Writes which test saw which fault to `docs/results/mutations.md`.

mod list;
mod stability;

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};

use self::list::{MUTATIONS, Mutation, Suite};
use self::stability::STABILITY;
use crate::vulkan;
use crate::workspace::{Workspace, execute};

/// Names of tests that stand in the table for one fault; the others are counted.
const NAMED: usize = 2;

/// Every fault.
fn all() -> impl Iterator<Item = &'static Mutation> {
    MUTATIONS.iter().chain(STABILITY)
}

/// Tries every fault whose description contains `filter`; writes the page only when all were tried.
pub fn run(workspace: &Workspace, filter: &str) -> Result<()> {
    let adapters = vulkan::require(workspace)?;
    let copy = Copy::new(workspace)?;
    let chosen: Vec<&Mutation> = all().filter(|mutation| mutation.fault.contains(filter)).collect();
    ensure!(!chosen.is_empty(), "no fault's description contains `{filter}`");
    for suite in Suite::ALL.into_iter().filter(|suite| chosen.iter().any(|m| m.suite == *suite)) {
        let failed = copy.failing_tests(suite)?;
        ensure!(failed.is_empty(), "{suite:?} fails without any fault: {}", failed.join(", "));
    }
    let (mut rows, mut unseen) = (String::new(), Vec::new());
    for (number, mutation) in (1..).zip(&chosen) {
        let failed = copy.with(mutation, || copy.failing_tests(mutation.suite))?;
        println!("{number}/{} {}: {} tests failed", chosen.len(), mutation.fault, failed.len());
        if failed.is_empty() {
            unseen.push(mutation.fault);
        }
        writeln!(rows, "{}", row(number, mutation, &failed))?;
    }
    let commit = copy.commit()?;
    copy.remove(workspace)?;
    if !unseen.is_empty() {
        bail!("no test saw: {}", unseen.join("; "));
    }
    if filter.is_empty() {
        let path = workspace.root.join("docs/results/mutations.md");
        fs::write(&path, page(&rows, chosen.len(), &commit, &adapters))?;
        println!("written: {}", path.display());
    }
    Ok(())
}

fn row(number: usize, mutation: &Mutation, failed: &[String]) -> String {
    let names: Vec<String> = failed.iter().take(NAMED).map(|name| format!("`{name}`")).collect();
    let more = match failed.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|");
    let code = |text: &str| format!("`{}`", words(text));
    let file = Path::new(mutation.file).file_name().unwrap_or_default().to_string_lossy();
    let (fault, from, to) = (mutation.fault, code(mutation.from), code(mutation.to));
    format!("| {number} | {fault} | {file}: {from} → {to} | {}{more} |", names.join(", "))
}

fn page(rows: &str, count: usize, commit: &str, adapters: &str) -> String {
    format!(
        "# Mutations\n\n\
         {count} faults, put in one at a time; each made at least one test fail. Without a fault all of these tests passed in the same\n\
         run. Written by `cargo xtask mutations` at commit {commit}; adapters: {adapters}. The lists are\n\
         in `xtask/src/mutations/`.\n\n\
         | | fault | change | seen by |\n|---|---|---|---|\n{rows}"
    )
}

/// A copy of the last commit, with a folder of builds of its own.
struct Copy {
    root: PathBuf,
    target: PathBuf,
}

impl Copy {
    fn new(workspace: &Workspace) -> Result<Self> {
        let folder = workspace.target_dir()?.join("mutations");
        let copy = Self { root: folder.join("checkout"), target: folder.join("target") };
        copy.remove(workspace)?;
        execute(workspace.command("git").args(["worktree", "add", "--detach", "--quiet"]).arg(&copy.root))?;
        Ok(copy)
    }

    fn commit(&self) -> Result<String> {
        Workspace { root: self.root.clone(), ci: false }.commit()
    }

    fn remove(&self, workspace: &Workspace) -> Result<()> {
        if self.root.exists() {
            execute(workspace.command("git").args(["worktree", "remove", "--force"]).arg(&self.root))?;
        }
        Ok(())
    }

    /// Does `work` with the fault in place.
    fn with<T>(&self, mutation: &Mutation, work: impl FnOnce() -> Result<T>) -> Result<T> {
        let path = self.root.join(mutation.file);
        let text = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        let found = text.matches(mutation.from).count();
        ensure!(found == 1, "{}: `{}` stands there {found} times, not once", mutation.file, mutation.from);
        fs::write(&path, text.replace(mutation.from, mutation.to))?;
        let outcome = work();
        fs::write(&path, text)?;
        outcome
    }

    /// Names of the tests of `suite` that fail.
    fn failing_tests(&self, suite: Suite) -> Result<Vec<String>> {
        let here = Workspace { root: self.root.clone(), ci: false };
        let mut command = here.cargo("test");
        command.env("CARGO_TARGET_DIR", &self.target).env("CUTIS_REQUIRE_GPU", "1");
        command.envs([("LP_NUM_THREADS", "0"), ("NODEVICE_SELECT", "1"), ("RUST_BACKTRACE", "0")]);
        let output = command.args(suite.arguments()).output().context("cannot start cargo")?;
        let text = String::from_utf8_lossy(&output.stdout);
        let failed = failed_tests(&text);
        if failed.is_empty() && !output.status.success() {
            let errors = String::from_utf8_lossy(&output.stderr);
            bail!("{suite:?} did not run to its end:\n{}", errors.trim());
        }
        Ok(failed)
    }
}

/// The names in `test NAME ... FAILED` lines.
fn failed_tests(output: &str) -> Vec<String> {
    let name = |line: &str| line.strip_prefix("test ")?.strip_suffix(" ... FAILED").map(str::to_owned);
    let mut names: Vec<String> = output.lines().filter_map(name).collect();
    names.sort();
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failing_tests_are_read_off_the_output() {
        let output = "running 3 tests\ntest a::b ... ok\ntest a::c ... FAILED\ntest d ... ignored\n\nfailures:\n    a::c\n";
        assert_eq!(failed_tests(output), ["a::c"]);
        assert!(failed_tests("test result: FAILED. 2 passed").is_empty());
    }

    #[test]
    fn the_page_says_where_it_was_written() {
        let text = page("| 1 |\n", 1, "0123abc", "card (driver 1.0)");
        assert!(
            text.contains("commit 0123abc; adapters: card (driver 1.0).") && text.ends_with("| 1 |\n"),
            "{text}"
        );
    }

    /// Every fault can be put in: its text stands in its file exactly once, and the change is one.
    #[test]
    fn every_fault_has_its_place() {
        let workspace = Workspace::find().unwrap();
        for mutation in all() {
            let text = fs::read_to_string(workspace.root.join(mutation.file)).expect(mutation.file);
            assert_eq!(text.matches(mutation.from).count(), 1, "{}: {}", mutation.file, mutation.from);
            assert_ne!(mutation.from, mutation.to, "{}", mutation.fault);
        }
        assert!(MUTATIONS.len() >= 20);
    }

    /// The page in the repository was written after the last fault was added.
    #[test]
    fn the_page_names_every_fault() {
        let text =
            fs::read_to_string(Workspace::find().unwrap().root.join("docs/results/mutations.md")).unwrap();
        let rows = text.lines().filter(|line| line.starts_with("| ") && !line.starts_with("| |")).count();
        assert_eq!(rows, all().count());
        for mutation in all() {
            assert!(text.contains(&format!("| {} |", mutation.fault)), "{}", mutation.fault);
        }
    }
}
