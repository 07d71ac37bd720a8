//! A measurement: one configuration on one problem, with its time and its errors.

use serde::Serialize;

use super::config::{Backend, Config, PBD};
use super::errors::KindError;
use crate::kit::{Row, number};

/// A body is at rest if it moves by less than this share of its displacement in the second half of
/// its frames.
pub const AT_REST: f64 = 0.05;

/// The figures of one configuration. E1 and E2 are absent for PBD, which has no limit to compare
/// with. Figures at rest are absent where a run to rest would take too many sweeps.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Measurement {
    /// Name of the problem.
    #[serde(rename = "case")]
    pub problem: &'static str,
    /// Name of the backend.
    pub backend: &'static str,
    /// `xpbd`, `vbd` or `pbd`.
    pub formulation: &'static str,
    /// Over-relaxation, if there is any.
    pub variant: &'static str,
    /// Substeps of a frame.
    pub substeps: u32,
    /// Iterations of a substep.
    pub iterations: u32,
    /// Timed frames.
    pub frames: usize,
    /// Shortest frame, ms.
    pub ms_min: f64,
    /// Median frame, ms.
    pub ms_median: f64,
    /// E1: the largest over the instants.
    pub e1: Option<f64>,
    /// E2: against the fine run.
    pub e2: Option<f64>,
    /// E3: against the equilibrium.
    pub e3: Option<f64>,
    /// E4: the largest error in `residuals`.
    pub e4: Option<f64>,
    /// Motion in the second half of the frames over the displacement at the end. E3 and E4 contain
    /// a temporal error of this size.
    pub residual_motion: Option<f64>,
    /// Opening of the wound over the opening at the equilibrium.
    pub opening: Option<f64>,
    /// Effective stiffness over the stiffness of the material.
    pub stiffness: Option<f64>,
    /// E4 of each kind of constraint.
    pub residuals: Vec<KindError>,
    /// Reason why the run ended early.
    pub failure: Option<String>,
}

impl Measurement {
    /// The measurement of `config`, without figures.
    pub fn of(problem: &'static str, config: &Config) -> Self {
        Self {
            problem,
            backend: config.backend.name(),
            formulation: config.method.formulation,
            variant: config.method.variant,
            substeps: config.substeps,
            iterations: config.iterations,
            ..Self::default()
        }
    }

    /// Backend and method: all measurements of one color in a chart.
    pub fn family(&self) -> String {
        format!("{} {}", self.backend, self.method())
    }

    /// Formulation and variant.
    pub fn method(&self) -> String {
        format!("{} {}", self.formulation, self.variant).trim_end().to_owned()
    }

    /// Method, substeps × iterations, and the time of a frame in brackets.
    pub fn setting(&self) -> String {
        format!("{} {} × {} ({} ms)", self.method(), self.substeps, self.iterations, number(self.ms_min))
    }

    /// True for the CPU backend in `f32` with a material: what a scene uses by default.
    pub fn is_usual(&self) -> bool {
        self.backend == Backend::Cpu.name() && self.formulation != PBD.formulation
    }

    /// One of the four errors.
    pub fn error(&self, measure: Measure) -> Option<f64> {
        match measure {
            Measure::E1 => self.e1,
            Measure::E2 => self.e2,
            Measure::E3 => self.e3,
            Measure::E4 => self.e4,
        }
    }

    /// True if the body had not come to rest. E3 and E4 then contain a temporal error.
    pub fn still_moves(&self) -> bool {
        self.residual_motion.is_some_and(|motion| motion.is_nan() || motion > AT_REST)
    }

    /// The error; `None` for E3 and E4 of a body that still moves.
    pub fn valid_error(&self, measure: Measure) -> Option<f64> {
        let valid = matches!(measure, Measure::E1 | Measure::E2) || !self.still_moves();
        self.error(measure).filter(|_| valid)
    }
}

impl Row for Measurement {
    const COLUMNS: &'static [&'static str] = &[
        "problem",
        "backend",
        "method",
        "substeps",
        "iterations",
        "ms_min",
        "e1",
        "e2",
        "e3",
        "e4",
        "residual_motion",
        "opening_ratio",
        "stiffness_ratio",
    ];

    fn cells(&self) -> Vec<String> {
        let figures =
            [self.e1, self.e2, self.e3, self.e4, self.residual_motion, self.opening, self.stiffness];
        let mut cells = vec![self.problem.to_owned(), self.backend.to_owned(), self.method()];
        cells.extend([self.substeps, self.iterations].map(|n| n.to_string()));
        cells.push(format!("{:.4}", self.ms_min));
        cells.extend(figures.map(|figure| figure.map_or_else(String::new, |x| format!("{x:.3e}"))));
        cells
    }
}

/// An error measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// Algebraic: one implicit substep against its minimizer.
    E1,
    /// Temporal: the trajectory against many more substeps.
    E2,
    /// Physical: the body at rest against the equilibrium.
    E3,
    /// Residual: the body at rest against the residuals of the equilibrium.
    E4,
}

impl Measure {
    /// All measures.
    pub const ALL: [Self; 4] = [Self::E1, Self::E2, Self::E3, Self::E4];

    /// `E1` to `E4`.
    pub fn name(self) -> &'static str {
        match self {
            Self::E1 => "E1",
            Self::E2 => "E2",
            Self::E3 => "E3",
            Self::E4 => "E4",
        }
    }

    /// Title of a chart or column.
    pub fn label(self) -> &'static str {
        match self {
            Self::E1 => "E1: one substep against its minimizer",
            Self::E2 => "E2: motion against many more substeps",
            Self::E3 => "E3: rest against the equilibrium",
            Self::E4 => "E4: residuals against the equilibrium",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kit::Table;

    #[test]
    fn absent_figures_are_empty_cells() {
        let full =
            Measurement { e1: Some(0.01), variant: "ω 1.4", formulation: "vbd", ..Measurement::default() };
        let text = Table::of(&[full, Measurement::default()]).csv();
        assert!(text.contains("vbd ω 1.4,0,0,0.0000,1.000e-2,,,,,,\n"), "{text}");
    }

    #[test]
    fn a_body_that_moves_has_no_valid_error_at_rest() {
        let at_rest = Measurement { e3: Some(0.01), residual_motion: Some(0.04), ..Measurement::default() };
        assert_eq!(at_rest.valid_error(Measure::E3), Some(0.01));
        for motion in [0.06, f64::NAN] {
            let moving = Measurement { residual_motion: Some(motion), ..at_rest.clone() };
            assert_eq!(moving.valid_error(Measure::E3), None);
        }
    }
}
