//! A case: a body, a run, and the requirement for its end.

use cutis_solver::Settings;

use super::body::Body;
use super::energy::{RESOLVED, UNRESOLVED};

/// Requirement for the end of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End {
    /// All numbers are finite and the energy is bounded.
    Bounded,
    /// The largest value over rest size of every kind falls below this number and stays below.
    Recovers(f64),
    /// The kinetic energy falls below a millionth of the available energy and stays below.
    Rests,
    /// No bit of a position has changed.
    Unmoved,
    /// [`check_collapsed`](cutis_solver::System::check_collapsed) names an element that cannot act.
    Named,
}

/// Settings of a run.
#[derive(Clone, Copy, Debug)]
pub struct Run {
    /// Length of a substep in s.
    pub h: f64,
    /// Substeps of a frame.
    pub substeps: u32,
    /// Sweeps over all constraints in a substep.
    pub iterations: u32,
    /// Number of samples of the body.
    pub samples: usize,
    /// Frames between two samples.
    pub frames: usize,
    /// In lengths of the body per s².
    pub gravity: [f64; 3],
    /// As in [`Settings`].
    pub damping_per_s: f64,
    /// As in [`Settings`].
    pub relaxation: f64,
}

impl Default for Run {
    /// Two seconds in substeps of 1/240 s, damped.
    fn default() -> Self {
        Self {
            h: 1.0 / 240.0,
            substeps: 4,
            iterations: 1,
            samples: 120,
            frames: 1,
            gravity: [0.0; 3],
            damping_per_s: 4.0,
            relaxation: 1.0,
        }
    }
}

/// A case, before it runs on a backend at a scale.
#[derive(Clone, Debug)]
pub struct Case {
    /// Name: the topic of the case and its stiffness.
    pub name: String,
    /// The body.
    pub body: Body,
    /// Settings of the run.
    pub run: Run,
    /// Largest total energy over the available energy: see [`Meter`](super::energy::Meter).
    pub energy: f64,
    /// Requirement for the end of a run.
    pub end: End,
    /// Part of the quick run.
    pub quick: bool,
    /// Why the case does not meet its requirement, if that is known.
    pub known_failure: Option<&'static str>,
}

impl Case {
    /// A case with the default run and this requirement.
    pub fn new(name: impl Into<String>, body: Body, end: End) -> Self {
        let energy = if body.law.is_resolved() || body.law.is_implicit() { RESOLVED } else { UNRESOLVED };
        Self { name: name.into(), body, run: Run::default(), energy, end, quick: false, known_failure: None }
    }

    /// Allows the energy of a stiffness that no substep resolves.
    pub fn unresolved(self) -> Self {
        let energy = if self.body.law.is_implicit() { self.energy } else { UNRESOLVED };
        Self { energy, ..self }
    }

    /// Makes the case part of the quick run.
    pub fn quick(self) -> Self {
        Self { quick: true, ..self }
    }

    /// Marks the case as one that does not meet its requirement. The results list it, and a run
    /// does not fail because of it.
    pub fn known_failure(self, why: &'static str) -> Self {
        Self { known_failure: Some(why), ..self }
    }

    /// Sets the settings of the run.
    pub fn run(self, run: Run) -> Self {
        Self { run, ..self }
    }

    /// Settings at a scale.
    pub fn settings(&self, scale: f64) -> Settings {
        let Run { h, substeps, iterations, gravity, damping_per_s, relaxation, .. } = self.run;
        Settings {
            formulation: self.body.law.formulation(),
            dt_s: h * f64::from(substeps),
            substeps,
            iterations,
            gravity_m_s2: gravity.map(|g| g * scale),
            damping_per_s,
            relaxation,
        }
    }
}
