//! `cargo xtask tidy`: checks the rules of the workspace that a program can check. Each rule is a
//! function from text to findings, with a test that shows what it catches.

mod crates;
mod docs;
mod features;
mod files;
mod gpu_access;
mod layers;
mod manifests;
mod not_clean;
mod prose;
mod rules;
mod shaders;
mod source;
mod text;
mod words;

use std::fmt;

use anyhow::{Context, Result, bail};

use crate::workspace::{Scope, Workspace};
pub use docs::{link_targets, resolve};
use files::Files;
use not_clean::{Filter, Rule};
use source::Source;
use text::Text;
use words::Words;

/// A violation of a rule.
#[derive(Debug, PartialEq)]
pub struct Finding {
    severity: Severity,
    /// Path from the root, or the name of a crate.
    place: String,
    /// Line from 1, or 0 for the whole file.
    line: usize,
    message: String,
}

/// Whether a finding fails the check.
#[derive(Debug, PartialEq)]
enum Severity {
    Warning,
    Failure,
}

impl Finding {
    fn failure(place: &str, line: usize, message: impl Into<String>) -> Self {
        Self { severity: Severity::Failure, place: place.to_owned(), line, message: message.into() }
    }

    fn warning(place: &str, line: usize, message: impl Into<String>) -> Self {
        Self { severity: Severity::Warning, ..Self::failure(place, line, message) }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = if self.severity == Severity::Warning { "warning" } else { "failure" };
        match self.line {
            0 => write!(f, "{kind}: {}: {}", self.place, self.message),
            line => write!(f, "{kind}: {}:{line}: {}", self.place, self.message),
        }
    }
}

/// Applies every rule to the checkout.
pub fn run(workspace: &Workspace) -> Result<()> {
    check(workspace, false)
}

/// Applies every rule, with `all` also in the paths that do not follow some rule yet.
pub fn check(workspace: &Workspace, all: bool) -> Result<()> {
    let files = Files::list(&workspace.root)?;
    let mut filter = Filter::new(all);
    let mut findings = in_manifests(workspace, &files, &mut filter)?;
    findings.extend(docs::required(&files));
    findings.extend(docs::in_summary(&files, &files.read("docs/SUMMARY.md")?));
    findings.extend(in_files(workspace, &files, &mut filter)?);
    findings.extend(filter.warnings());
    for finding in &findings {
        println!("{finding}");
    }
    let failures = findings.iter().filter(|finding| finding.severity == Severity::Failure).count();
    println!("tidy: {failures} failures, {} warnings", findings.len() - failures);
    if failures > 0 {
        bail!("tidy found {failures} failures");
    }
    Ok(())
}

/// Rules about crates and manifests.
fn in_manifests(workspace: &Workspace, files: &Files, filter: &mut Filter) -> Result<Vec<Finding>> {
    let manifest = workspace.root.join("Cargo.toml");
    let metadata = workspace.metadata(&manifest, Scope::Members)?;
    let packages = layers::packages(&metadata)?;
    let manifests = manifests::members(&metadata, &workspace.root)?;
    let mut findings = layers::check(&packages);
    findings.extend(features::switched_off(&workspace.metadata(&manifest, Scope::Dependencies)?)?);
    let names = packages.iter().map(layers::Package::name);
    findings.extend(docs::crates_named(docs::ARCHITECTURE, &files.read(docs::ARCHITECTURE)?, names));
    for path in files.with_extension("toml").filter(|path| path.ends_with("Cargo.toml")) {
        findings.extend(gpu_access::in_manifest(path, &files.read(path)?));
    }
    for path in &manifests {
        let text = files.read(path)?;
        findings.extend(manifests::check(path, &text));
        findings.extend(manifests::licenses(path, &text, files));
    }
    let crates = crates::members(&metadata, &manifests)?;
    findings.extend(filter.apply(Rule::OneTestBinary, crates::one_test_binary(&crates)));
    for path in files.with_extension("rs") {
        let source = Source::parse(path, &files.read(path)?);
        findings.extend(crates::tested_without_features(&source, &crates));
        findings.extend(filter.apply(Rule::PathAttribute, crates::files_of_other_crates(&source, &crates)));
    }
    Ok(findings)
}

/// Rules about the text of one file.
fn in_files(workspace: &Workspace, files: &Files, filter: &mut Filter) -> Result<Vec<Finding>> {
    let words = std::fs::read_to_string(workspace.root.join(words::TABLE)).context(words::TABLE)?;
    let words = Words::parse(&words).context(words::TABLE)?;
    let mut findings = Vec::new();
    for extension in ["rs", "wgsl", "md", "py"] {
        for path in files.with_extension(extension) {
            let text = files.read(path)?;
            findings.extend(filter.apply(Rule::Words, words.check(&Text::parse(path, &text))));
            if extension == "py" {
                findings.extend(filter.apply(Rule::Width, prose::python_width(path, &text)));
            }
            if extension == "md" {
                findings.extend(filter.apply(Rule::Width, prose::page_width(path, &text)));
                findings.extend(docs::links(path, &text, files));
                findings.extend(docs::ignored_examples(path, &text));
            }
            if path == docs::ARCHITECTURE {
                findings.extend(docs::named_paths(path, &text, files));
            }
            if extension == "rs" || extension == "wgsl" {
                let source = Source::parse(path, &text);
                let rules = if extension == "rs" { rules::ALL } else { shaders::ALL };
                findings.extend(rules.iter().flat_map(|rule| rule(&source)));
                findings.extend(gpu_access::in_source(&source));
                findings.extend(filter.apply(Rule::Width, prose::comment_width(&source)));
                findings.extend(filter.apply(Rule::Fragments, prose::fragments(&source)));
            }
        }
    }
    Ok(findings)
}
