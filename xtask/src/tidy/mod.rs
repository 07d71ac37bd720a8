//! `cargo xtask tidy`: holds what a machine can hold of the workspace's rules. Each rule is a function from text to
//! findings, with a test that shows it what it must catch.

mod docs;
mod features;
mod files;
mod gpu_access;
mod layers;
mod manifests;
mod rules;
mod shaders;
mod source;

use std::fmt;

use anyhow::{Result, bail};

use crate::workspace::{Scope, Workspace};
use files::Files;
use source::Source;

/// Something a rule found.
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
    let files = Files::list(&workspace.root)?;
    let manifest = workspace.root.join("Cargo.toml");
    let metadata = workspace.metadata(&manifest, Scope::Members)?;

    let packages = layers::packages(&metadata)?;
    let mut findings = layers::check(&packages);
    findings.extend(features::switched_off(&workspace.metadata(&manifest, Scope::Dependencies)?)?);
    findings.extend(docs::required(&files));
    let mut sources = 0;
    for path in files.with_extension("rs") {
        let source = Source::parse(path, &files.read(path)?);
        findings.extend(rules::ALL.iter().flat_map(|rule| rule(&source)));
        findings.extend(gpu_access::in_source(&source));
        sources += 1;
    }
    let mut shaders = 0;
    for path in files.with_extension("wgsl") {
        let source = Source::parse(path, &files.read(path)?);
        findings.extend(shaders::ALL.iter().flat_map(|rule| rule(&source)));
        shaders += 1;
    }
    let mut pages = 0;
    for path in files.with_extension("md") {
        let text = files.read(path)?;
        findings.extend(docs::links(path, &text, &files));
        findings.extend(docs::ignored_examples(path, &text));
        if path == docs::ARCHITECTURE {
            findings.extend(docs::named_paths(path, &text, &files));
            findings.extend(docs::crates_named(path, &text, packages.iter().map(layers::Package::name)));
        }
        pages += 1;
    }
    for path in files.with_extension("toml").filter(|path| path.ends_with("Cargo.toml")) {
        findings.extend(gpu_access::in_manifest(path, &files.read(path)?));
    }
    for path in manifests::members(&metadata, &workspace.root)? {
        let text = files.read(&path)?;
        findings.extend(manifests::check(&path, &text));
        findings.extend(manifests::licenses(&path, &text, &files));
    }

    for finding in &findings {
        println!("{finding}");
    }
    let failures = findings.iter().filter(|finding| finding.severity == Severity::Failure).count();
    println!(
        "tidy: {sources} sources, {shaders} shaders, {pages} pages, {failures} failures, {} warnings",
        findings.len() - failures
    );
    if failures > 0 {
        bail!("tidy found {failures} failures");
    }
    Ok(())
}
