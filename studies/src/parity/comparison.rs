//! A comparison: figures, verdict, and its row in the result.

use std::collections::BTreeMap;

use serde::Serialize;

use super::expected::ExpectedFailure;

/// A group of comparisons, from single operations to whole runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ring {
    /// Value and gradients of a single constraint.
    Op,
    /// One pass on the device.
    Kernel,
    /// Whole runs.
    Scene,
    /// Momentum and energy of a long run, on any device.
    Invariant,
    /// Passes in `f32` on the device and in `f64` on the CPU: near, not equal. In the ring of
    /// kernels the same passes are equal to their `f32` twins.
    Oracle,
    /// One step of the largest lattice.
    FullSize,
}

impl Ring {
    /// Name in tables and in JSON.
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
    /// Number of compared numbers, voxels or pixels.
    pub compared: u64,
    /// Number of those that are not equal.
    pub differing: u64,
    /// The largest difference in units of `of`. Null in JSON if it is not finite.
    pub worst: f64,
    /// The largest allowed difference.
    pub tolerance: f64,
    /// Unit of `worst`.
    pub of: &'static str,
}

/// Result of a measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// True if the two sides agree within the tolerance. A control must not agree.
    pub agrees: bool,
    /// The figures.
    pub figures: Figures,
}

impl Measured {
    /// A result. It does not agree if nothing was compared.
    pub fn new(agrees: bool, figures: Figures) -> Self {
        Self { agrees: agrees && figures.compared > 0, figures }
    }

    /// A figure with a bound. NaN exceeds every bound.
    pub fn at_most(compared: u64, worst: f64, tolerance: f64, of: &'static str) -> Self {
        let differing = compared * u64::from(worst != 0.0);
        Self::new(worst <= tolerance, Figures { compared, differing, worst, tolerance, of })
    }
}

/// Verdict on a comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// All numbers are equal.
    Exact,
    /// All differences are within the tolerance.
    Within,
    /// A control was rejected, as required.
    Rejected,
    /// The comparison failed as expected: see [`ExpectedFailure`].
    ExpectedFailure,
    /// The two sides do not agree.
    Failed,
    /// A control passed: the comparison does not notice the fault.
    ControlPassed,
    /// The comparison passed although it was expected to fail: the expectation must be removed.
    UnexpectedPass,
    /// The comparison ended with an error.
    Error,
}

impl Verdict {
    /// True if the command may succeed with this verdict.
    pub fn is_good(self) -> bool {
        matches!(self, Self::Exact | Self::Within | Self::Rejected | Self::ExpectedFailure)
    }
}

/// A comparison or a control, with its verdict.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// Ring.
    pub ring: Ring,
    /// Name of the comparison.
    pub name: String,
    /// The backend that is compared with the CPU.
    pub backend: &'static str,
    /// Name of the adapter.
    pub adapter: String,
    /// The deliberate fault of a control.
    pub control: Option<String>,
    /// Verdict.
    pub outcome: Verdict,
    /// Figures. Null after an error.
    pub figures: Option<Figures>,
    /// Further figures by name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub details: BTreeMap<&'static str, f64>,
    /// Reason of a failure or of an expected failure.
    pub note: Option<String>,
}

/// A comparison without its result.
#[derive(Clone, Debug)]
pub struct Subject<'a> {
    /// Ring.
    pub ring: Ring,
    /// Name of the comparison.
    pub name: &'a str,
    /// Name of the adapter.
    pub adapter: &'a str,
    /// The deliberate fault of a control.
    pub control: Option<&'a str>,
}

impl Comparison {
    /// Judges a result or an error.
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
                (Verdict::ControlPassed, Some("the fault was not noticed".into()))
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
    fn a_comparison_must_agree_and_a_control_must_not() {
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
        // Only for this comparison on this adapter, and never for a control.
        assert_eq!(outcome("distance", "odd card", None, Ok(false)), Verdict::Failed);
        assert_eq!(outcome("volume", "card", None, Ok(false)), Verdict::Failed);
        assert_eq!(outcome("volume", "odd card", Some("wrong"), Ok(true)), Verdict::ControlPassed);
        assert_eq!(outcome("volume", "odd card", Some("wrong"), Ok(false)), Verdict::Rejected);
    }

    #[test]
    fn nan_and_an_empty_comparison_do_not_agree() {
        assert!(!Measured::at_most(1, f64::NAN, 1.0, "extent").agrees);
        assert!(!Measured::at_most(0, 0.0, 1.0, "extent").agrees);
        assert!(Measured::at_most(1, 1.0, 1.0, "extent").agrees);
    }

    #[test]
    fn a_comparison_has_the_documented_keys() {
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
