//! What a check found: figures, each with what it had to be.

use std::fmt;

/// What a figure had to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limit {
    /// At most this.
    AtMost(f64),
    /// More than this. A **negative control**: something that is wrong on purpose has to be seen.
    MoreThan(f64),
}

/// One figure of a check.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// What was measured, of what.
    pub what: String,
    /// What came out.
    pub figure: f64,
    /// What it had to be.
    pub limit: Limit,
}

impl Row {
    /// Whether the figure is what it had to be. NaN never is.
    pub fn passed(&self) -> bool {
        match self.limit {
            Limit::AtMost(bound) => self.figure <= bound,
            Limit::MoreThan(bound) => self.figure > bound,
        }
    }

    /// Whether it is a negative control.
    pub fn is_control(&self) -> bool {
        matches!(self.limit, Limit::MoreThan(_))
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = if self.passed() { "ok    " } else { "FAILED" };
        let (sign, bound) = match self.limit {
            Limit::AtMost(bound) => ("≤", bound),
            Limit::MoreThan(bound) => (">", bound),
        };
        write!(f, "{verdict} {}: {:.3e} ({sign} {bound:.3e})", self.what, self.figure)
    }
}

/// How a check ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All figures are what they had to be, and every control was seen.
    Passed,
    /// Some figure is not.
    Failed,
    /// Not applicable, with the reason.
    LeftOut(&'static str),
}

/// What a check found about a constraint.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// The constraint's name.
    pub constraint: &'static str,
    /// The check's name.
    pub check: &'static str,
    /// Name of the adapter, for a check on a device.
    pub adapter: Option<String>,
    /// Why the check was not made.
    pub left_out: Option<&'static str>,
    /// What was measured.
    pub rows: Vec<Row>,
    /// Remarks that explain the rows: a compiler's message, the name of what was found.
    pub notes: Vec<String>,
}

impl Report {
    pub(crate) fn new(constraint: &'static str, check: &'static str) -> Self {
        Self { constraint, check, adapter: None, left_out: None, rows: Vec::new(), notes: Vec::new() }
    }

    pub(crate) fn left_out(constraint: &'static str, check: &'static str, reason: &'static str) -> Self {
        Self { left_out: Some(reason), ..Self::new(constraint, check) }
    }

    pub(crate) fn at_most(&mut self, what: impl Into<String>, figure: f64, bound: f64) {
        self.rows.push(Row { what: what.into(), figure, limit: Limit::AtMost(bound) });
    }

    pub(crate) fn control(&mut self, what: impl fmt::Display, figure: f64, bound: f64) {
        let what = format!("control, {what}");
        self.rows.push(Row { what, figure, limit: Limit::MoreThan(bound) });
    }

    pub(crate) fn note(&mut self, note: impl Into<String>) {
        self.notes.push(note.into());
    }

    /// How the check ended. A check that measured nothing, though not left out, failed.
    pub fn outcome(&self) -> Outcome {
        match self.left_out {
            Some(reason) => Outcome::LeftOut(reason),
            None if !self.rows.is_empty() && self.rows.iter().all(Row::passed) => Outcome::Passed,
            None => Outcome::Failed,
        }
    }

    /// Rows that are not what they had to be.
    pub fn failures(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(|row| !row.passed())
    }

    /// For tests: ends them unless the check passed or was left out.
    ///
    /// # Panics
    /// If the check failed, with the rows that did.
    #[track_caller]
    pub fn assert_passed(&self) {
        let rows = self.failures().cloned().collect();
        assert!(self.outcome() != Outcome::Failed, "{}", Self { rows, ..self.clone() });
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {}", self.constraint, self.check)?;
        if let Some(adapter) = &self.adapter {
            write!(f, " on {adapter}")?;
        }
        match self.outcome() {
            Outcome::Passed => write!(f, ": passed")?,
            Outcome::Failed => write!(f, ": FAILED")?,
            Outcome::LeftOut(reason) => write!(f, ": left out, {reason}")?,
        }
        for row in &self.rows {
            write!(f, "\n  {row}")?;
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
    fn a_figure_that_is_no_number_fails_either_way() {
        let mut report = Report::new("c", "check");
        report.at_most("error", f64::NAN, 1.0);
        report.control("error", f64::NAN, 1.0);
        assert_eq!(report.failures().count(), 2);
        assert_eq!(report.outcome(), Outcome::Failed);
    }

    #[test]
    fn a_check_that_measured_nothing_failed() {
        assert_eq!(Report::new("c", "check").outcome(), Outcome::Failed);
        assert_eq!(Report::left_out("c", "check", "why").outcome(), Outcome::LeftOut("why"));
    }

    #[test]
    fn a_control_that_is_not_seen_fails() {
        let mut report = Report::new("c", "check");
        report.at_most("error", 1e-7, 1e-6);
        assert_eq!(report.outcome(), Outcome::Passed);
        report.control("off by 1e-3", 1e-7, 1e-6);
        assert_eq!(report.outcome(), Outcome::Failed);
        let text = report.to_string();
        assert!(text.contains("FAILED control, off by 1e-3: 1.000e-7 (> 1.000e-6)"), "{text}");
    }
}
