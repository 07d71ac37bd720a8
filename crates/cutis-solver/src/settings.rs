//! Settings of the time integration, validated once when a solver is built.

use crate::SolverError;

/// The method that turns the value of a constraint into a correction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "schema",
    derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema),
    serde(rename_all = "lowercase")
)]
pub enum Formulation {
    /// PBD with a stiffness in `[0, 1]` per iteration (Müller et al. 2007). The result depends on
    /// the number of iterations and the time step.
    Pbd,
    /// XPBD, which has compliances in physical units (Macklin et al. 2016).
    ///
    /// The energy `½kC²` has the compliance `1/k`, in m/N for a length.
    #[default]
    Xpbd,
    /// Vertex block descent with the compliances of XPBD (Chen et al. 2024). A body at rest is in
    /// equilibrium for any number of iterations and substeps.
    ///
    /// It lowers the energy of the step vertex by vertex.
    Vbd,
}

/// Time step, iterations and external forces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The formulation. Every kind of the system needs a stiffness for it.
    pub formulation: Formulation,
    /// Duration of one frame in seconds.
    pub dt_s: f64,
    /// Number of substeps of one frame, each `h = dt_s/substeps` long.
    pub substeps: u32,
    /// Number of sweeps over all constraints in one substep.
    pub iterations: u32,
    /// Gravity in m/s².
    pub gravity_m_s2: [f64; 3],
    /// Damping: every substep multiplies velocities by `exp(−damping_per_s·h)`. 0 = undamped.
    pub damping_per_s: f64,
    /// Over-relaxation `ω` of [`Formulation::Vbd`], above 0 and below 2. Must be 1 for the other
    /// formulations. Values above 1 help many iterations to converge, but not a single one.
    pub relaxation: f64,
}

impl Default for Settings {
    /// Returns XPBD at 60 Hz with 10 substeps of one iteration, without gravity and damping.
    fn default() -> Self {
        Self {
            formulation: Formulation::default(),
            dt_s: 1.0 / 60.0,
            substeps: 10,
            iterations: 1,
            gravity_m_s2: [0.0; 3],
            damping_per_s: 0.0,
            relaxation: 1.0,
        }
    }
}

impl Settings {
    /// Returns the length of a substep in seconds.
    pub fn substep_s(&self) -> f64 {
        self.dt_s / f64::from(self.substeps)
    }

    /// True if multipliers must be stored from one sweep to the next.
    pub fn keeps_multipliers(&self) -> bool {
        self.formulation == Formulation::Xpbd && self.iterations > 1
    }

    /// Checks every value.
    ///
    /// # Errors
    /// Returns [`SolverError::Setting`] for the first value out of range.
    pub fn validate(&self) -> Result<(), SolverError> {
        let check = |key, value: f64, valid: bool, expected| {
            if valid { Ok(()) } else { Err(SolverError::Setting { key, value, expected }) }
        };
        let positive = self.dt_s.is_finite() && self.dt_s > 0.0;
        check("dt_s", self.dt_s, positive, "a finite time above 0 s")?;
        check("substeps", self.substeps.into(), self.substeps > 0, "at least 1")?;
        check("iterations", self.iterations.into(), self.iterations > 0, "at least 1")?;
        for value in self.gravity_m_s2 {
            check("gravity_m_s2", value, value.is_finite(), "three finite numbers")?;
        }
        let damping = self.damping_per_s;
        check("damping_per_s", damping, damping.is_finite() && damping >= 0.0, "a finite number, 0 or more")?;
        let relaxation = self.relaxation;
        if self.formulation == Formulation::Vbd {
            check(
                "relaxation",
                relaxation,
                relaxation > 0.0 && relaxation < 2.0,
                "a number above 0 and below 2",
            )
        } else {
            check("relaxation", relaxation, relaxation == 1.0, "1, except for vertex block descent")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_name_the_setting_that_is_out_of_range() {
        let good = Settings::default();
        assert!(good.validate().is_ok());
        let relaxed = Settings { relaxation: 1.5, formulation: Formulation::Vbd, ..good };
        assert!(relaxed.validate().is_ok());
        let bad = [
            ("dt_s", Settings { dt_s: 0.0, ..good }),
            ("dt_s", Settings { dt_s: f64::NAN, ..good }),
            ("substeps", Settings { substeps: 0, ..good }),
            ("iterations", Settings { iterations: 0, ..good }),
            ("gravity_m_s2", Settings { gravity_m_s2: [0.0, f64::INFINITY, 0.0], ..good }),
            ("damping_per_s", Settings { damping_per_s: -1.0, ..good }),
            ("relaxation", Settings { relaxation: 1.5, ..good }),
            ("relaxation", Settings { relaxation: 2.0, formulation: Formulation::Vbd, ..good }),
            ("relaxation", Settings { relaxation: f64::NAN, formulation: Formulation::Vbd, ..good }),
        ];
        for (expected, settings) in bad {
            let Err(SolverError::Setting { key, .. }) = settings.validate() else {
                panic!("{expected} must be refused");
            };
            assert_eq!(key, expected);
        }
    }
}
