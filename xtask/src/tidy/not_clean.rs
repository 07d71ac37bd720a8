//! Paths that do not follow a rule yet. The list is empty and should stay empty.

use std::collections::BTreeMap;

use super::{Finding, Severity};

/// A rule with exempt paths.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Rule {
    Words,
    Width,
    Fragments,
    OneTestBinary,
    PathAttribute,
}

/// Rules with the paths, by their first parts, that do not follow them yet.
const NOT_CLEAN: &[(Rule, &[&str])] = &[];

/// Findings by rule, without those in exempt paths, which are only counted.
pub struct Filter {
    exempt: &'static [(Rule, &'static [&'static str])],
    skipped: BTreeMap<(Rule, &'static str), usize>,
}

impl Filter {
    /// With `all` no path is exempt.
    pub fn new(all: bool) -> Self {
        Self::with(if all { &[] } else { NOT_CLEAN })
    }

    fn with(exempt: &'static [(Rule, &'static [&'static str])]) -> Self {
        let pairs = exempt.iter().flat_map(|(rule, paths)| paths.iter().map(|path| ((*rule, *path), 0)));
        Self { exempt, skipped: pairs.collect() }
    }

    /// Counts and removes the findings in exempt paths.
    pub fn apply(&mut self, rule: Rule, findings: Vec<Finding>) -> Vec<Finding> {
        let paths =
            self.exempt.iter().filter(|(listed, _)| *listed == rule).flat_map(|(_, paths)| paths.iter());
        let paths: Vec<&'static str> = paths.copied().collect();
        let mut kept = Vec::new();
        for finding in findings {
            match paths.iter().find(|path| finding.place.starts_with(**path)) {
                Some(path) => *self.skipped.entry((rule, path)).or_default() += 1,
                None => kept.push(finding),
            }
        }
        kept
    }

    /// A warning for each exempt path with its number of findings.
    pub fn warnings(&self) -> Vec<Finding> {
        let warning = |(&(rule, path), &count): (&(Rule, &str), &usize)| Finding {
            severity: Severity::Warning,
            place: path.to_owned(),
            line: 0,
            message: match count {
                0 => format!("follows the rule {rule:?} now: remove it from `xtask/src/tidy/not_clean.rs`"),
                _ => format!("breaks the rule {rule:?} {count} times; `cargo xtask tidy --all` prints them"),
            },
        };
        self.skipped.iter().map(warning).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn findings_in_exempt_paths_are_only_counted() {
        let mut filter = Filter::with(&[(Rule::Words, &["docs/", "tests/"])]);
        let findings = || vec![Finding::failure("docs/a.md", 1, "x"), Finding::failure("README.md", 1, "x")];
        assert_eq!(filter.apply(Rule::Words, findings()).len(), 1);
        assert_eq!(filter.apply(Rule::Width, findings()).len(), 2);
        let warnings: Vec<String> = filter.warnings().iter().map(ToString::to_string).collect();
        assert_eq!(warnings.len(), 2);
        assert!(warnings[0].starts_with("warning: docs/") && warnings[0].contains("1 times"), "{warnings:?}");
        assert!(warnings[1].contains("remove it"), "{warnings:?}");
    }

    #[test]
    fn with_all_nothing_is_exempt() {
        let mut filter = Filter::new(true);
        for (rule, paths) in NOT_CLEAN {
            let findings: Vec<Finding> = paths.iter().map(|path| Finding::failure(path, 1, "x")).collect();
            assert_eq!(filter.apply(*rule, findings).len(), paths.len());
        }
        assert_eq!(filter.warnings(), []);
    }
}
