//! The results of a check: measured values with their limits.

use std::fmt;

/// The limit of a measured value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limit {
    /// The value must be at most this.
    AtMost(f64),
    /// The value must be more than this. This is a **negative control**: the check must notice a
    /// deliberate error.
    MoreThan(f64),
}

/// A measured value of a check and its limit.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// The measured quantity.
    pub what: String,
    /// The measured value.
    pub value: f64,
    /// The limit of the value.
    pub limit: Limit,
}

impl Finding {
    /// Returns whether the value is within its limit. NaN never is.
    pub fn passed(&self) -> bool {
        match self.limit {
            Limit::AtMost(bound) => self.value <= bound,
            Limit::MoreThan(bound) => self.value > bound,
        }
    }

    /// Returns whether this is a negative control.
    pub fn is_control(&self) -> bool {
        matches!(self.limit, Limit::MoreThan(_))
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = if self.passed() { "ok    " } else { "FAILED" };
        let (sign, bound) = match self.limit {
            Limit::AtMost(bound) => ("≤", bound),
            Limit::MoreThan(bound) => (">", bound),
        };
        write!(f, "{verdict} {}: {:.3e} ({sign} {bound:.3e})", self.what, self.value)
    }
}

/// The overall result of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// All values are within their limits, and every negative control was noticed.
    Passed,
    /// At least one value is not within its limit.
    Failed,
    /// The check does not apply, for this reason.
    Skipped(&'static str),
}

/// The results of one check of a constraint.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// The constraint's name.
    pub constraint: &'static str,
    /// The check's name.
    pub check: &'static str,
    /// Name of the adapter, for a check on a device.
    pub adapter: Option<String>,
    /// The reason if the check was skipped.
    pub skipped: Option<&'static str>,
    /// The measured values.
    pub findings: Vec<Finding>,
    /// Remarks that explain the findings, such as a compiler message.
    pub notes: Vec<String>,
}

impl Report {
    pub(crate) fn new(constraint: &'static str, check: &'static str) -> Self {
        Self { constraint, check, adapter: None, skipped: None, findings: Vec::new(), notes: Vec::new() }
    }

    pub(crate) fn skipped(constraint: &'static str, check: &'static str, reason: &'static str) -> Self {
        Self { skipped: Some(reason), ..Self::new(constraint, check) }
    }

    pub(crate) fn at_most(&mut self, what: impl Into<String>, value: f64, bound: f64) {
        self.findings.push(Finding { what: what.into(), value, limit: Limit::AtMost(bound) });
    }

    pub(crate) fn control(&mut self, what: impl fmt::Display, value: f64, bound: f64) {
        let what = format!("control, {what}");
        self.findings.push(Finding { what, value, limit: Limit::MoreThan(bound) });
    }

    pub(crate) fn note(&mut self, note: impl Into<String>) {
        self.notes.push(note.into());
    }

    /// Returns the overall result. A check that measured nothing and was not skipped failed.
    pub fn verdict(&self) -> Verdict {
        match self.skipped {
            Some(reason) => Verdict::Skipped(reason),
            None if !self.findings.is_empty() && self.findings.iter().all(Finding::passed) => Verdict::Passed,
            None => Verdict::Failed,
        }
    }

    /// Returns the findings outside their limits.
    fn failures(&self) -> impl Iterator<Item = &Finding> {
        self.findings.iter().filter(|finding| !finding.passed())
    }

    /// Panics unless the check passed or was skipped. For tests.
    ///
    /// # Panics
    /// If the check failed; the message lists the failed findings.
    #[track_caller]
    pub fn assert_passed(&self) {
        let findings = self.failures().cloned().collect();
        assert!(self.verdict() != Verdict::Failed, "{}", Self { findings, ..self.clone() });
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {}", self.constraint, self.check)?;
        if let Some(adapter) = &self.adapter {
            write!(f, " on {adapter}")?;
        }
        match self.verdict() {
            Verdict::Passed => write!(f, ": passed")?,
            Verdict::Failed => write!(f, ": FAILED")?,
            Verdict::Skipped(reason) => write!(f, ": skipped, {reason}")?,
        }
        for finding in &self.findings {
            write!(f, "\n  {finding}")?;
        }
        for note in &self.notes {
            write!(f, "\n  note: {note}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_that_is_not_a_number_fails() {
        let mut report = Report::new("c", "check");
        report.at_most("error", f64::NAN, 1.0);
        report.control("error", f64::NAN, 1.0);
        assert_eq!(report.failures().count(), 2);
        assert_eq!(report.verdict(), Verdict::Failed);
    }

    #[test]
    fn a_check_without_findings_fails() {
        assert_eq!(Report::new("c", "check").verdict(), Verdict::Failed);
        assert_eq!(Report::skipped("c", "check", "why").verdict(), Verdict::Skipped("why"));
    }

    #[test]
    fn an_unnoticed_control_fails() {
        let mut report = Report::new("c", "check");
        report.at_most("error", 1e-7, 1e-6);
        assert_eq!(report.verdict(), Verdict::Passed);
        report.control("off by 1e-3", 1e-7, 1e-6);
        assert_eq!(report.verdict(), Verdict::Failed);
        let text = report.to_string();
        assert!(text.contains("FAILED control, off by 1e-3: 1.000e-7 (> 1.000e-6)"), "{text}");
    }
}
