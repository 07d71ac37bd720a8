//! Known failures with their reasons, as data: a known failure that passes fails the command.

use super::comparison::Subject;

/// A comparison that fails on an adapter, with the reason.
#[derive(Clone, Copy, Debug)]
pub struct ExpectedFailure {
    /// Part of the name of the adapter; case does not matter.
    pub adapter: &'static str,
    /// Part of the name of the comparison.
    pub row: &'static str,
    /// Reason of the failure.
    pub reason: &'static str,
}

/// The known failures: none.
pub const EXPECTED: &[ExpectedFailure] = &[];

impl ExpectedFailure {
    /// True if it applies to this comparison. It never applies to a control.
    pub fn is_about(&self, subject: &Subject<'_>) -> bool {
        subject.control.is_none()
            && subject.name.contains(self.row)
            && subject.adapter.to_lowercase().contains(&self.adapter.to_lowercase())
    }
}
