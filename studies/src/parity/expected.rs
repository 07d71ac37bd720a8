//! Failures that are known, with their reasons: data, so that one that is gone is noticed.

use super::comparison::Subject;

/// A comparison that fails on an adapter, and why.
#[derive(Clone, Copy, Debug)]
pub struct ExpectedFailure {
    /// Part of the adapter's name, upper or lower case alike.
    pub adapter: &'static str,
    /// Part of the row's name.
    pub row: &'static str,
    /// Why it fails, and where that is written.
    pub reason: &'static str,
}

/// What is known to fail: nothing.
pub const EXPECTED: &[ExpectedFailure] = &[];

impl ExpectedFailure {
    /// Whether it speaks of this row. Controls are never expected to fail.
    pub fn is_about(&self, subject: &Subject<'_>) -> bool {
        subject.control.is_none()
            && subject.name.contains(self.row)
            && subject.adapter.to_lowercase().contains(&self.adapter.to_lowercase())
    }
}
