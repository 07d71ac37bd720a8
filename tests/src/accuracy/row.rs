//! One row of the result: a configuration on a problem, its time and its errors; and all rows as CSV.

use std::fmt::Write as _;

use super::config::{Backend, Config, PBD};
use super::errors::KindError;
use super::words::ms;

/// A body that moves by less than this share of its displacement in the second half of its frames has come to rest.
pub const AT_REST: f64 = 0.05;

/// A configuration's figures. What was not measured is absent: E1 and E2 of PBD, whose result has no limit in either; what
/// belongs to rest where too many sweeps kept it from being waited for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Row {
    /// Name of the problem.
    pub problem: &'static str,
    /// Backend.
    pub backend: &'static str,
    /// `xpbd` and so on.
    pub formulation: &'static str,
    /// What else is chosen.
    pub variant: &'static str,
    /// Of a frame.
    pub substeps: u32,
    /// Of a substep.
    pub iterations: u32,
    /// Frames that were timed.
    pub frames: usize,
    /// Shortest frame, ms.
    pub ms_min: f64,
    /// Middle one, ms.
    pub ms_median: f64,
    /// The largest over the instants.
    pub e1: Option<f64>,
    /// Against the fine run.
    pub e2: Option<f64>,
    /// Against the equilibrium.
    pub e3: Option<f64>,
    /// The largest of `residuals`' errors.
    pub e4: Option<f64>,
    /// Motion in the second half of the frames over the displacement at their end: what E3 and E4 owe to time.
    pub unrest: Option<f64>,
    /// Opening of the wound over that of the equilibrium.
    pub opening: Option<f64>,
    /// Effective over material stiffness.
    pub stiffness: Option<f64>,
    /// E4 by kind.
    pub residuals: Vec<KindError>,
    /// Why it was broken off.
    pub failure: Option<String>,
}

impl Row {
    /// The row of `config`, without figures.
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

    /// The configuration without its numbers: what a line of a chart has in common, with the substeps.
    pub fn family(&self) -> String {
        format!("{} {}", self.backend, self.method())
    }

    /// Formulation and variant.
    pub fn method(&self) -> String {
        let gap = if self.variant.is_empty() { "" } else { " " };
        format!("{}{gap}{}", self.formulation, self.variant)
    }

    /// Method, substeps × iterations, and in brackets the ms of a frame.
    pub fn setting(&self) -> String {
        format!("{} {} × {} ({} ms)", self.method(), self.substeps, self.iterations, ms(self.ms_min))
    }

    /// In the page: family, substeps × iterations.
    pub fn name(&self) -> String {
        format!("{}, {} × {}", self.family(), self.substeps, self.iterations)
    }

    /// Whether a run of a scene on the CPU may use it, and it solves for the material's answer.
    pub fn is_usual(&self) -> bool {
        self.backend == Backend::Cpu.name() && self.formulation != PBD.formulation
    }

    /// Sweeps of a frame.
    pub fn sweeps(&self) -> u32 {
        self.substeps * self.iterations
    }

    /// The four errors, by name.
    pub fn error(&self, measure: Measure) -> Option<f64> {
        match measure {
            Measure::E1 => self.e1,
            Measure::E2 => self.e2,
            Measure::E3 => self.e3,
            Measure::E4 => self.e4,
        }
    }

    /// Whether the body had not come to rest in its frames, so that E3 and E4 say something about time.
    pub fn still_moves(&self) -> bool {
        self.unrest.is_some_and(|unrest| unrest.is_nan() || unrest > AT_REST)
    }

    /// The error, unless it is one of a settled body and the body still moves.
    pub fn valid_error(&self, measure: Measure) -> Option<f64> {
        let valid = matches!(measure, Measure::E1 | Measure::E2) || !self.still_moves();
        self.error(measure).filter(|_| valid)
    }
}

/// Which error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// Algebraic: one implicit substep against its minimizer.
    E1,
    /// Temporal: the trajectory against many more substeps.
    E2,
    /// Physical: at rest, against the equilibrium.
    E3,
    /// Residual: at rest, against the equilibrium's.
    E4,
}

impl Measure {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::E1, Self::E2, Self::E3, Self::E4];

    /// `E1` and so on.
    pub fn name(self) -> &'static str {
        match self {
            Self::E1 => "E1",
            Self::E2 => "E2",
            Self::E3 => "E3",
            Self::E4 => "E4",
        }
    }

    /// What it is, for a chart.
    pub fn label(self) -> &'static str {
        match self {
            Self::E1 => "E1: one substep against its minimizer",
            Self::E2 => "E2: motion against many more substeps",
            Self::E3 => "E3: rest against the equilibrium",
            Self::E4 => "E4: residuals against the equilibrium's",
        }
    }
}

/// Kinds whose residuals have columns.
const KINDS: [&str; 3] = ["distance", "volume", "stc"];

/// All rows, with a line of names.
pub fn csv(rows: &[Row]) -> String {
    let mut text = String::from(
        "problem,backend,formulation,variant,substeps,iterations,frames,ms_min,ms_median,e1,e2,e3,e4,unrest,opening_ratio,\
         stiffness_ratio",
    );
    for kind in KINDS {
        let _ = write!(text, ",{kind}_residual,{kind}_residual_at_equilibrium,{kind}_residual_error");
    }
    text.push_str(",failure\n");
    for row in rows {
        let _ = write!(
            text,
            "{},{},{},{},{},{},{},{:.4},{:.4}",
            row.problem,
            row.backend,
            row.formulation,
            row.variant,
            row.substeps,
            row.iterations,
            row.frames,
            row.ms_min,
            row.ms_median
        );
        let figures = [row.e1, row.e2, row.e3, row.e4, row.unrest, row.opening, row.stiffness]
            .into_iter()
            .chain(KINDS.into_iter().flat_map(|name| {
                let kind = row.residuals.iter().find(|kind| kind.name == name);
                [kind.map(|k| k.found), kind.map(|k| k.equilibrium), kind.map(|k| k.error)]
            }));
        for figure in figures {
            let _ = write!(text, ",{}", figure.map_or_else(String::new, |figure| format!("{figure:.4e}")));
        }
        let _ = writeln!(text, ",{}", row.failure.as_deref().unwrap_or("").replace([',', '\n'], ";"));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_has_as_many_fields_as_the_first() {
        let residuals = vec![KindError { name: "volume", found: 0.5, equilibrium: 0.25, error: 0.125 }];
        let full =
            Row { e1: Some(0.01), residuals, failure: Some("no, it\nfailed".into()), ..Row::default() };
        let text = csv(&[full, Row::default()]);
        let counts: Vec<usize> = text.lines().map(|line| line.matches(',').count()).collect();
        assert_eq!(counts, [counts[0]; 3]);
        assert!(
            text.contains(",1.0000e-2,")
                && text.contains(",,,,5.0000e-1,2.5000e-1,1.2500e-1,,,,no; it;failed")
        );
    }
}
