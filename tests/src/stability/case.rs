//! A case: a body, how it is run, and what must hold.

use cutis_solver::Settings;

use super::body::Body;
use super::energy::{RESOLVED, UNRESOLVED};

/// What must hold at the end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End {
    /// Nothing more than finite numbers and a bounded energy.
    Bounded,
    /// The largest value over rest size of every kind falls below this and stays there.
    Recovers(f64),
    /// The kinetic energy falls below a millionth of the energy that was there to be had, and stays there.
    Rests,
    /// No vertex has moved by a bit.
    Unmoved,
    /// [`check_collapsed`](cutis_solver::System::check_collapsed) names an element that cannot act.
    Named,
}

/// How a body is run.
#[derive(Clone, Copy, Debug)]
pub struct Run {
    /// Length of a substep in s.
    pub h: f64,
    /// Substeps between two looks at the body.
    pub substeps: u32,
    /// Sweeps over all constraints in a substep.
    pub iterations: u32,
    /// How often the body is looked at.
    pub looks: usize,
    /// Frames between two looks.
    pub frames: usize,
    /// In the body's own lengths, per s².
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
            looks: 120,
            frames: 1,
            gravity: [0.0; 3],
            damping_per_s: 4.0,
            relaxation: 1.0,
        }
    }
}

/// One line of the table, before it is run on a backend at a scale.
#[derive(Clone, Debug)]
pub struct Case {
    /// What is tried, on what.
    pub name: String,
    /// The body.
    pub body: Body,
    /// How it is run.
    pub run: Run,
    /// What the total energy may be at most, over what it may be without an error of the method: see [`Meter`](super::energy::Meter).
    pub energy: f64,
    /// What must hold at the end.
    pub end: End,
    /// Part of the quick run.
    pub quick: bool,
}

impl Case {
    /// A case with the default run, which must end like this.
    pub fn new(name: impl Into<String>, body: Body, end: End) -> Self {
        let energy = if body.law.is_resolved() || body.law.is_implicit() { RESOLVED } else { UNRESOLVED };
        Self { name: name.into(), body, run: Run::default(), energy, end, quick: false }
    }

    /// With the energy that a stiffness may have that no substep resolves.
    pub fn unresolved(self) -> Self {
        let energy = if self.body.law.is_implicit() { self.energy } else { UNRESOLVED };
        Self { energy, ..self }
    }

    /// Part of the quick run as well.
    pub fn quick(self) -> Self {
        Self { quick: true, ..self }
    }

    /// Run like this.
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
