//! How a case ended.

use std::fmt;

/// How a case ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// It came back to its rest shape, or to rest.
    Settled,
    /// Its numbers stayed finite and its energy bounded, and nothing more was asked.
    Bounded,
    /// An element that cannot act was named.
    Named(String),
    /// It was refused at the door by an error that names what is wrong.
    Refused(String),
    /// It did not end as it must.
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

impl Outcome {
    /// Whether it ended as it must.
    pub fn is_good(&self) -> bool {
        !matches!(self, Self::Failed(_))
    }

    /// The words of an error, or of what failed.
    pub fn note(&self) -> &str {
        match self {
            Self::Settled | Self::Bounded => "",
            Self::Named(note) | Self::Refused(note) | Self::Failed(note) => note,
        }
    }
}

/// One line of the table.
#[derive(Clone, Debug)]
pub struct Row {
    /// Name of the case.
    pub case: String,
    /// What it ran on.
    pub backend: String,
    /// What the geometry was multiplied by; none where there is no geometry to scale.
    pub scale: Option<f64>,
    /// How it ended.
    pub outcome: Outcome,
    /// Largest total energy over what was there to be had.
    pub energy_ratio: Option<f64>,
    /// Simulated time after which it stayed as it must.
    pub recovery_s: Option<f64>,
    /// Largest value over rest size at the end.
    pub error: Option<f64>,
    /// Share of rounding in the energy that was there to be had.
    pub heat: Option<f64>,
    /// Seconds that it took.
    pub wall_s: f64,
}

impl Row {
    /// A row without results.
    pub fn new(case: &str, backend: &str, scale: Option<f64>) -> Self {
        Self {
            case: case.into(),
            backend: backend.into(),
            scale,
            outcome: Outcome::Failed("not run".into()),
            energy_ratio: None,
            recovery_s: None,
            error: None,
            heat: None,
            wall_s: 0.0,
        }
    }

    /// It failed for this reason.
    pub fn fail(&mut self, reason: String) {
        self.outcome = Outcome::Failed(reason);
    }
}
