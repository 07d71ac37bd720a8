//! Mutations: deliberate faults, one at a time, in a copy of the last commit. At least one test
//! must fail for each.

mod chainmail;
mod list;
mod outputs;
mod stability;

use std::fs;
use std::io::Write;
use std::path::PathBuf;

use anyhow::{Context, bail, ensure};
use clap::Parser;

use self::chainmail::CHAINMAIL;
use self::list::{MUTATIONS, Mutation, Suite};
use self::outputs::OUTPUTS;
use self::stability::STABILITY;
use crate::kit::{Failure, Page, Provenance, Table, cargo, command, execute, results, target_dir};

/// Applies each fault to a copy of the last commit and runs the tests that must notice it.
#[derive(Clone, Debug, Parser)]
#[command(name = "mutations", bin_name = "cargo xtask study mutations")]
pub struct Options {
    /// Only the faults of this suite of tests.
    #[arg(long, value_name = "NAME", value_parser = Suite::ALL.map(Suite::name))]
    pub suite: Option<String>,
    /// Write docs/results/mutations.md: the sections of the suites that ran.
    #[arg(long, conflicts_with = "text")]
    pub write: bool,
    /// Only faults whose description contains this text.
    pub text: Option<String>,
}

impl Options {
    fn selects(&self, mutation: &Mutation) -> bool {
        self.suite.as_ref().is_none_or(|name| mutation.suite.name() == name)
            && self.text.as_ref().is_none_or(|text| mutation.fault.contains(text.as_str()))
    }
}

/// All mutations.
fn all() -> impl Iterator<Item = &'static Mutation> {
    MUTATIONS.iter().chain(STABILITY).chain(CHAINMAIL).chain(OUTPUTS)
}

/// Tables of the page: faults and provenance of each suite.
pub fn tables() -> Vec<String> {
    Suite::ALL.iter().flat_map(|suite| [suite.name().to_owned(), provenance_of(*suite)]).collect()
}

fn provenance_of(suite: Suite) -> String {
    format!("{}-provenance", suite.name())
}

/// Applies the faults. Returns whether each of them made a test fail.
///
/// # Errors
/// The tests of a suite fail without a fault, a fault cannot be applied, or the tests do not build.
pub fn run(options: &Options, out: &mut dyn Write) -> Result<bool, Failure> {
    let mut page = options.write.then(|| Page::open("mutations", &tables())).transpose()?;
    let chosen: Vec<&Mutation> = all().filter(|mutation| options.selects(mutation)).collect();
    ensure!(!chosen.is_empty(), "no fault matches");
    ensure!(!cutis_gpu::adapters().is_empty(), "the tests need a GPU adapter; a software adapter is enough");
    let copy = Copy::new()?;
    let (mut unnoticed, mut tried) = (Vec::new(), 0);
    for suite in Suite::ALL.into_iter().filter(|suite| chosen.iter().any(|m| m.suite == *suite)) {
        let mut provenance = Provenance::start(&format!("mutations --suite {} --write", suite.name()));
        cutis_gpu::adapters().iter().for_each(|adapter| provenance.adapter(&adapter.name));
        let failed = copy.failing_tests(suite)?;
        ensure!(failed.is_empty(), "{suite:?} fails without any fault: {}", failed.join(", "));
        let mut table = Table::new(["fault", "file", "failing tests", "one of them"]);
        for mutation in chosen.iter().filter(|mutation| mutation.suite == suite) {
            let failed = copy.with(mutation, || copy.failing_tests(suite))?;
            tried += 1;
            let [number, count] = [chosen.len(), failed.len()];
            writeln!(
                out,
                "{tried}/{number} {}: {count} tests failed: {}",
                mutation.fault,
                failed.join(", ")
            )?;
            match failed.first() {
                None => unnoticed.push(mutation.fault),
                Some(first) => table.add([
                    mutation.fault.to_owned(),
                    format!("`{}`", mutation.file),
                    failed.len().to_string(),
                    format!("`{first}`"),
                ]),
            }
        }
        if let Some(page) = &mut page {
            page.set(suite.name(), &table.markdown())?;
            page.set(&provenance_of(suite), &provenance.markdown())?;
        }
    }
    copy.remove()?;
    for fault in &unnoticed {
        writeln!(out, "no test noticed: {fault}")?;
    }
    if let Some(page) = page.filter(|_| unnoticed.is_empty()) {
        page.save(&results())?;
    }
    Ok(unnoticed.is_empty())
}

/// A copy of the last commit with its own folder of builds.
struct Copy {
    root: PathBuf,
    target: PathBuf,
}

impl Copy {
    fn new() -> Result<Self, Failure> {
        let folder = target_dir()?.join("mutations");
        let copy = Self { root: folder.join("checkout"), target: folder.join("target") };
        copy.remove()?;
        execute(command("git").args(["worktree", "add", "--detach", "--quiet"]).arg(&copy.root))?;
        Ok(copy)
    }

    fn remove(&self) -> Result<(), Failure> {
        if self.root.exists() {
            execute(command("git").args(["worktree", "remove", "--force"]).arg(&self.root))?;
        }
        Ok(())
    }

    /// Runs `work` while the fault is in the copy.
    fn with<T>(&self, mutation: &Mutation, work: impl FnOnce() -> Result<T, Failure>) -> Result<T, Failure> {
        let path = self.root.join(mutation.file);
        let text = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        let found = text.matches(mutation.from).count();
        ensure!(found == 1, "{}: `{}` occurs {found} times, not once", mutation.file, mutation.from);
        fs::write(&path, text.replace(mutation.from, mutation.to))?;
        let outcome = work();
        fs::write(&path, text)?;
        outcome
    }

    /// Names of the tests of `suite` that fail.
    fn failing_tests(&self, suite: Suite) -> Result<Vec<String>, Failure> {
        let mut command = cargo("test");
        command.current_dir(&self.root);
        command.env("CARGO_TARGET_DIR", &self.target).env("CUTIS_REQUIRE_GPU", "1");
        command.envs([("LP_NUM_THREADS", "0"), ("NODEVICE_SELECT", "1"), ("RUST_BACKTRACE", "0")]);
        let output = command.args(suite.arguments()).output().context("cannot start cargo")?;
        let failed = failed_tests(&String::from_utf8_lossy(&output.stdout));
        if failed.is_empty() && !output.status.success() {
            let errors = String::from_utf8_lossy(&output.stderr);
            bail!("{suite:?} did not run to its end:\n{}", errors.trim());
        }
        Ok(failed)
    }
}

/// The names in lines of the form `test NAME ... FAILED`.
fn failed_tests(output: &str) -> Vec<String> {
    let name = |line: &str| line.strip_prefix("test ")?.strip_suffix(" ... FAILED").map(str::to_owned);
    let mut names: Vec<String> = output.lines().filter_map(name).collect();
    names.sort();
    names
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kit::root;

    #[test]
    fn failing_tests_are_read_from_the_output() {
        let output = "running 3 tests\ntest a::b ... ok\ntest a::c ... FAILED\ntest d ... ignored\n\nfailures:\n    a::c\n";
        assert_eq!(failed_tests(output), ["a::c"]);
        assert!(failed_tests("test result: FAILED. 2 passed").is_empty());
    }

    #[test]
    fn every_fault_can_be_applied() {
        for mutation in all() {
            let text = fs::read_to_string(root().join(mutation.file)).expect(mutation.file);
            assert_eq!(text.matches(mutation.from).count(), 1, "{}: {}", mutation.file, mutation.from);
            assert_ne!(mutation.from, mutation.to, "{}", mutation.fault);
        }
        assert!(MUTATIONS.len() >= 20 && CHAINMAIL.len() >= 14);
    }

    /// The page in the repository is as new as the list of faults.
    #[test]
    fn the_page_names_every_fault() {
        let text = fs::read_to_string(results().join("mutations.md")).unwrap();
        let is_row = |line: &&str| line.starts_with("| ") && !line.starts_with("| fault |");
        assert_eq!(text.lines().filter(is_row).count(), all().count());
        for mutation in all() {
            assert!(text.contains(&format!("| {} |", mutation.fault)), "{}", mutation.fault);
        }
    }
}
