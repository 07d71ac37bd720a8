//! A trial: one case on one backend at one length scale, with its outcome and figures.

use std::fmt;

use serde::{Serialize, Serializer};

/// How a trial ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The body came back to its rest shape, or to rest.
    Settled,
    /// All numbers stayed finite and the energy stayed bounded. Nothing more is required.
    Bounded,
    /// A typed error named an element that cannot act.
    Named(String),
    /// A typed error refused the input and named what is wrong.
    Refused(String),
    /// A requirement was not met.
    Failed(String),
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Settled => "settled",
            Self::Bounded => "bounded",
            Self::Named(_) => "named",
            Self::Refused(_) => "refused",
            Self::Failed(_) => "FAILED",
        })
    }
}

impl Serialize for Outcome {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl Outcome {
    /// True unless a requirement was not met.
    pub fn is_good(&self) -> bool {
        !matches!(self, Self::Failed(_))
    }

    /// Text of the error or of the failure.
    pub fn note(&self) -> &str {
        match self {
            Self::Settled | Self::Bounded => "",
            Self::Named(note) | Self::Refused(note) | Self::Failed(note) => note,
        }
    }
}

/// The result of one case on one backend at one scale.
#[derive(Clone, Debug, Serialize)]
pub struct Trial {
    /// Name of the case.
    pub case: String,
    /// Name of the backend.
    pub backend: String,
    /// Factor on the geometry. `None` for input validation, which has no geometry to scale.
    pub scale: Option<f64>,
    /// How the trial ended.
    pub outcome: Outcome,
    /// Largest total energy over the available energy.
    pub energy_ratio: Option<f64>,
    /// Simulated time after which the requirement stayed met, s.
    pub recovery_s: Option<f64>,
    /// Largest value over rest size at the end.
    pub error: Option<f64>,
    /// Share of rounding in the available energy.
    pub rounding_share: Option<f64>,
    /// Wall time, s.
    pub wall_s: f64,
    /// Why the case does not meet its requirement, if that is known.
    pub known_failure: Option<&'static str>,
}

impl Trial {
    /// A trial without results.
    pub fn new(case: &str, backend: &str, scale: Option<f64>) -> Self {
        Self {
            case: case.into(),
            backend: backend.into(),
            scale,
            outcome: Outcome::Failed("not run".into()),
            energy_ratio: None,
            recovery_s: None,
            error: None,
            rounding_share: None,
            wall_s: 0.0,
            known_failure: None,
        }
    }
}
