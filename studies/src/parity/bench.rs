//! The bench of a ring: a device, its policy, and the log that records the comparisons.

use cutis_gpu::Gpu;

use super::comparison::{Comparison, Measured, Ring, Subject};
use super::difference::Policy;
use super::log::Log;

pub use crate::kit::Failure;

/// Size of the scenes and number of frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Effort {
    /// About half a minute.
    Quick,
    /// A few minutes.
    Normal,
    /// Also the demo at full size.
    Full,
}

/// A device to compare with the CPU.
pub struct Bench<'t, 'o> {
    /// The device.
    pub gpu: Gpu,
    /// Largest allowed difference.
    pub policy: Policy,
    /// Size of the scenes and number of frames.
    pub effort: Effort,
    /// Records the comparisons.
    pub log: &'t mut Log<'o>,
}

impl Bench<'_, '_> {
    /// Adds a comparison. Its result or error is in the returned row.
    ///
    /// # Errors
    /// The output cannot be written.
    pub fn compare(
        &mut self,
        ring: Ring,
        name: &str,
        measure: impl FnOnce(&Gpu, Policy) -> Result<Measured, Failure>,
    ) -> Result<&mut Comparison, Failure> {
        self.row(ring, name, None, measure)
    }

    /// Adds a control: the same comparison with a deliberate fault.
    ///
    /// # Errors
    /// As for [`compare`](Self::compare).
    pub fn control(
        &mut self,
        ring: Ring,
        name: &str,
        wrong: &str,
        measure: impl FnOnce(&Gpu, Policy) -> Result<Measured, Failure>,
    ) -> Result<(), Failure> {
        self.row(ring, name, Some(wrong), measure).map(|_| ())
    }

    fn row(
        &mut self,
        ring: Ring,
        name: &str,
        control: Option<&str>,
        measure: impl FnOnce(&Gpu, Policy) -> Result<Measured, Failure>,
    ) -> Result<&mut Comparison, Failure> {
        self.log.working_on(&format!("{}: {name}", ring.name()));
        let found = measure(&self.gpu, self.policy).map_err(|error| error.to_string());
        let adapter = &self.gpu.adapter().name;
        Ok(self.log.add(&Subject { ring, name, adapter, control }, found)?)
    }
}
