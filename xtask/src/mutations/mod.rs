//! `cargo xtask mutations`: faults put in on purpose, one at a time, in a copy of the checkout; each must make a test fail.
//! Writes which test saw which fault to `docs/results/mutations.md`.

mod chainmail;
mod list;
mod page;
mod stability;

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, bail, ensure};

use self::chainmail::CHAINMAIL;
use self::list::{MUTATIONS, Mutation, Suite};
use self::page::{Section, row};
use self::stability::STABILITY;
use crate::vulkan;
use crate::workspace::{Workspace, execute};

/// Where the page lies.
const PAGE: &str = "docs/results/mutations.md";

/// Every fault.
fn all() -> impl Iterator<Item = &'static Mutation> {
    MUTATIONS.iter().chain(STABILITY).chain(CHAINMAIL)
}

/// Which faults are tried.
#[derive(Clone, Copy, Debug)]
pub enum Choice<'a> {
    /// All of them.
    All,
    /// Those of the suite of this name.
    Suite(&'a str),
    /// Those whose description contains this.
    Containing(&'a str),
}

impl Choice<'_> {
    fn takes(self, mutation: &Mutation) -> bool {
        match self {
            Self::All => true,
            Self::Suite(name) => mutation.suite.name() == name,
            Self::Containing(text) => mutation.fault.contains(text),
        }
    }
}

/// Tries the faults; writes the sections of the page whose suites were tried as a whole by name.
pub fn run(workspace: &Workspace, choice: Choice<'_>) -> Result<()> {
    let chosen: Vec<&Mutation> = all().filter(|mutation| choice.takes(mutation)).collect();
    ensure!(!chosen.is_empty(), "there is no fault of this kind: {choice:?}");
    let adapters = vulkan::require(workspace)?;
    let copy = Copy::new(workspace)?;
    let suites = Suite::ALL.into_iter().filter(|suite| chosen.iter().any(|m| m.suite == *suite));
    let (mut sections, mut unseen, mut tried) = (Vec::new(), Vec::new(), 0);
    for suite in suites {
        let failed = copy.failing_tests(suite)?;
        ensure!(failed.is_empty(), "{suite:?} fails without any fault: {}", failed.join(", "));
        let mut rows = Vec::new();
        for mutation in chosen.iter().filter(|mutation| mutation.suite == suite) {
            let failed = copy.with(mutation, || copy.failing_tests(suite))?;
            tried += 1;
            println!("{tried}/{} {}: {} tests failed", chosen.len(), mutation.fault, failed.len());
            if failed.is_empty() {
                unseen.push(mutation.fault);
            }
            rows.push(row(rows.len() + 1, mutation, &failed));
        }
        sections.push(Section::new(suite, &rows, &copy.commit()?, &adapters));
    }
    copy.remove(workspace)?;
    if !unseen.is_empty() {
        bail!("no test saw: {}", unseen.join("; "));
    }
    if !matches!(choice, Choice::Containing(_)) {
        let path = workspace.root.join(PAGE);
        let before = if path.exists() { fs::read_to_string(&path)? } else { String::new() };
        fs::write(&path, page::with(&before, &sections)?)?;
        println!("written: {}", path.display());
    }
    Ok(())
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

    /// Every fault can be put in: its text stands in its file exactly once, and the change is one.
    #[test]
    fn every_fault_has_its_place() {
        let workspace = Workspace::find().unwrap();
        for mutation in all() {
            let text = fs::read_to_string(workspace.root.join(mutation.file)).expect(mutation.file);
            assert_eq!(text.matches(mutation.from).count(), 1, "{}: {}", mutation.file, mutation.from);
            assert_ne!(mutation.from, mutation.to, "{}", mutation.fault);
        }
        assert!(MUTATIONS.len() >= 20 && CHAINMAIL.len() >= 14);
    }

    /// The page in the repository was written after the last fault was added.
    #[test]
    fn the_page_names_every_fault() {
        let text = fs::read_to_string(Workspace::find().unwrap().root.join(PAGE)).unwrap();
        let rows = text.lines().filter(|line| line.starts_with("| ") && !line.starts_with("| |")).count();
        assert_eq!(rows, all().count());
        for mutation in all() {
            assert!(text.contains(&format!("| {} |", mutation.fault)), "{}", mutation.fault);
        }
    }
}
