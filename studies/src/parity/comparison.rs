//! What a comparison found, what it had to find, and how that is told.

use std::collections::BTreeMap;

use serde::Serialize;

use super::expected::ExpectedFailure;

/// How close to the arithmetic a comparison is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ring {
    /// Value and gradients of a constraint on their own.
    Op,
    /// One pass on the device.
    Kernel,
    /// Whole runs.
    Scene,
    /// What a long run must keep, on any device: momentum, energy.
    Invariant,
    /// What the device computes in `f32` and the CPU in `f64`: near, not equal. The same passes are equal to their `f32` twins
    /// in the ring of kernels.
    Oracle,
    /// The largest lattice, once.
    FullSize,
}

impl Ring {
    /// As in the table and in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Op => "op",
            Self::Kernel => "kernel",
            Self::Scene => "scene",
            Self::Invariant => "invariant",
            Self::Oracle => "oracle",
            Self::FullSize => "full-size",
        }
    }
}

/// The figures of a comparison.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Figures {
    /// Numbers, voxels or pixels that were compared.
    pub compared: u64,
    /// Those that are not equal.
    pub differing: u64,
    /// The largest difference, as a multiple of what `of` says; null in JSON if it is not finite.
    pub worst: f64,
    /// The largest that is allowed.
    pub tolerance: f64,
    /// What `worst` is measured by.
    pub of: &'static str,
}

/// What a comparison found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Whether the two sides agree as far as they have to. A control must not.
    pub agrees: bool,
    /// The figures.
    pub figures: Figures,
}

impl Measured {
    /// Where nothing was compared, nothing agrees.
    pub fn new(agrees: bool, figures: Figures) -> Self {
        Self { agrees: agrees && figures.compared > 0, figures }
    }

    /// A figure with a bound; NaN is beyond any.
    pub fn at_most(compared: u64, worst: f64, tolerance: f64, of: &'static str) -> Self {
        let differing = compared * u64::from(worst != 0.0);
        Self::new(worst <= tolerance, Figures { compared, differing, worst, tolerance, of })
    }
}

/// How a row ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// All is equal.
    Exact,
    /// All is near enough.
    Within,
    /// A control was rejected, as it must be.
    Rejected,
    /// It failed, and that is known: see [`ExpectedFailure`].
    ExpectedFailure,
    /// The two sides do not agree.
    Failed,
    /// A control passed: the comparison sees nothing.
    ControlPassed,
    /// It passed, although it is expected to fail: the expectation has to go.
    UnexpectedPass,
    /// It could not be carried out.
    Error,
}

impl Verdict {
    /// Whether the command may end well in spite of it.
    pub fn is_good(self) -> bool {
        matches!(self, Self::Exact | Self::Within | Self::Rejected | Self::ExpectedFailure)
    }
}

/// One row of the result.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// Ring.
    pub ring: Ring,
    /// What was compared.
    pub name: String,
    /// What is compared with the CPU.
    pub backend: &'static str,
    /// Name of the adapter.
    pub adapter: String,
    /// In a control: what is wrong on purpose and had to be rejected.
    pub control: Option<String>,
    /// How it ended.
    pub outcome: Verdict,
    /// The figures; null where it could not be carried out.
    pub figures: Option<Figures>,
    /// Further figures by name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub details: BTreeMap<&'static str, f64>,
    /// Why it failed, or is expected to.
    pub note: Option<String>,
}

/// What is compared: the row without its result.
#[derive(Clone, Debug)]
pub struct Subject<'a> {
    /// Ring.
    pub ring: Ring,
    /// What is compared.
    pub name: &'a str,
    /// Name of the adapter.
    pub adapter: &'a str,
    /// What is wrong on purpose.
    pub control: Option<&'a str>,
}

impl Comparison {
    /// The row of a comparison that found this, or could not be carried out.
    pub fn judge(
        subject: &Subject<'_>,
        found: Result<Measured, String>,
        expected: &[ExpectedFailure],
    ) -> Self {
        let known = expected.iter().find(|failure| failure.is_about(subject)).map(|failure| failure.reason);
        let figures = found.as_ref().ok().map(|measured| measured.figures);
        let (outcome, note) = match (found, subject.control, known) {
            (Err(error), Some(_), _) | (Err(error), None, None) => (Verdict::Error, Some(error)),
            (Ok(found), Some(_), _) if found.agrees => {
                (Verdict::ControlPassed, Some("something wrong on purpose went unseen".into()))
            }
            (Ok(_), Some(_), _) => (Verdict::Rejected, None),
            (Ok(found), None, Some(reason)) if found.agrees => {
                (Verdict::UnexpectedPass, Some(format!("no longer fails for this reason: {reason}")))
            }
            (_, None, Some(reason)) => (Verdict::ExpectedFailure, Some(reason.into())),
            (Ok(found), None, None) => match (found.agrees, found.figures.differing) {
                (true, 0) => (Verdict::Exact, None),
                (true, _) => (Verdict::Within, None),
                (false, _) => (Verdict::Failed, None),
            },
        };
        Self {
            ring: subject.ring,
            name: subject.name.into(),
            backend: "gpu",
            adapter: subject.adapter.into(),
            control: subject.control.map(Into::into),
            outcome,
            figures,
            details: BTreeMap::new(),
            note,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KNOWN: &[ExpectedFailure] =
        &[ExpectedFailure { adapter: "odd card", row: "volume", reason: "its division is off" }];

    fn outcome(name: &str, adapter: &str, control: Option<&str>, found: Result<bool, ()>) -> Verdict {
        let measured = |agrees: bool| {
            let worst = if agrees { 0.0 } else { 1.0 };
            Measured { agrees, ..Measured::at_most(1, worst, 0.5, "extent") }
        };
        let subject = Subject { ring: Ring::Op, name, adapter, control };
        Comparison::judge(&subject, found.map(measured).map_err(|()| "broken".into()), KNOWN).outcome
    }

    #[test]
    fn a_comparison_has_to_agree_and_a_control_must_not() {
        let on_card = |control, found| outcome("distance", "card", control, found);
        assert_eq!(on_card(None, Ok(true)), Verdict::Exact);
        assert_eq!(on_card(None, Ok(false)), Verdict::Failed);
        assert_eq!(on_card(Some("wrong"), Ok(false)), Verdict::Rejected);
        assert_eq!(on_card(Some("wrong"), Ok(true)), Verdict::ControlPassed);
        for control in [None, Some("wrong")] {
            assert_eq!(on_card(control, Err(())), Verdict::Error, "an error is no rejection");
        }
        for bad in [Verdict::Failed, Verdict::ControlPassed, Verdict::UnexpectedPass, Verdict::Error] {
            assert!(!bad.is_good());
        }
    }

    #[test]
    fn an_expected_failure_that_passes_is_a_failure() {
        let known = |found| outcome("volume, XPBD", "An Odd Card 3000", None, found);
        assert_eq!(known(Ok(false)), Verdict::ExpectedFailure);
        assert_eq!(known(Err(())), Verdict::ExpectedFailure);
        assert_eq!(known(Ok(true)), Verdict::UnexpectedPass);
        assert!(Verdict::ExpectedFailure.is_good());
        // Only that row on that adapter, and never a control.
        assert_eq!(outcome("distance", "odd card", None, Ok(false)), Verdict::Failed);
        assert_eq!(outcome("volume", "card", None, Ok(false)), Verdict::Failed);
        assert_eq!(outcome("volume", "odd card", Some("wrong"), Ok(true)), Verdict::ControlPassed);
        assert_eq!(outcome("volume", "odd card", Some("wrong"), Ok(false)), Verdict::Rejected);
    }

    #[test]
    fn a_figure_that_is_no_number_and_a_comparison_of_nothing_do_not_agree() {
        assert!(!Measured::at_most(1, f64::NAN, 1.0, "extent").agrees);
        assert!(!Measured::at_most(0, 0.0, 1.0, "extent").agrees);
        assert!(Measured::at_most(1, 1.0, 1.0, "extent").agrees);
    }

    #[test]
    fn a_row_has_the_keys_that_others_rely_on() {
        let subject = Subject { ring: Ring::Kernel, name: "n", adapter: "a", control: Some("wrong") };
        let row = Comparison::judge(&subject, Ok(Measured::at_most(3, f64::INFINITY, 1e-6, "extent")), &[]);
        let json = serde_json::to_value(&row).unwrap();
        for (key, value) in [("ring", "kernel"), ("name", "n"), ("backend", "gpu"), ("adapter", "a")] {
            assert_eq!(json[key], value);
        }
        assert_eq!(json["outcome"], "rejected");
        assert_eq!(json["control"], "wrong");
        assert_eq!(json["figures"]["compared"], 3);
        assert!(json["figures"]["worst"].is_null());
    }
}
