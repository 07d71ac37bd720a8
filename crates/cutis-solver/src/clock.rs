//! Simulated time, counted in whole frames and substeps.

use crate::Settings;

/// Number of frames and substeps that a simulation has completed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Clock {
    /// Completed frames.
    pub frame: u64,
    /// Completed substeps of the current frame.
    pub substep: u32,
}

impl Clock {
    /// Returns the simulated time in seconds.
    pub fn time_s(&self, settings: &Settings) -> f64 {
        self.frame as f64 * settings.dt_s + f64::from(self.substep) * settings.substep_s()
    }

    /// Advances the clock by one substep.
    pub fn tick(&mut self, settings: &Settings) {
        self.substep += 1;
        if self.substep == settings.substeps {
            (self.frame, self.substep) = (self.frame + 1, 0);
        }
    }
}
