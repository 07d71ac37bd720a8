//! Simulated time: frames done, and substeps done of the next one.

use crate::Settings;

/// How far a simulation has come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Clock {
    /// Whole frames.
    pub frame: u64,
    /// Substeps of the frame after those.
    pub substep: u32,
}

impl Clock {
    /// Simulated time in seconds.
    pub fn time_s(&self, settings: &Settings) -> f64 {
        self.frame as f64 * settings.dt_s + f64::from(self.substep) * settings.substep_s()
    }

    /// One substep later.
    pub fn tick(&mut self, settings: &Settings) {
        self.substep += 1;
        if self.substep == settings.substeps {
            (self.frame, self.substep) = (self.frame + 1, 0);
        }
    }
}
