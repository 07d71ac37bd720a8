//! What a ring works with: a device, what it is held to, and the table that takes the rows.

use std::error::Error;

use cutis_gpu::Gpu;

use super::difference::Policy;
use super::outcome::{Measured, Ring, Row, Subject};
use super::table::Table;

/// Whatever keeps a comparison from being carried out.
pub type Failure = Box<dyn Error>;

/// How much to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Effort {
    /// About half a minute.
    Quick,
    /// A few minutes.
    Normal,
    /// As long as it takes.
    Full,
}

/// A device under comparison.
pub struct Bench<'t, 'o> {
    /// The device.
    pub gpu: Gpu,
    /// What it is held to.
    pub policy: Policy,
    /// How much to do.
    pub effort: Effort,
    /// Takes the rows.
    pub table: &'t mut Table<'o>,
}

impl Bench<'_, '_> {
    /// Adds a comparison.
    ///
    /// # Errors
    /// The terminal's; what the comparison finds, and its errors, are in the row.
    pub fn compare(
        &mut self,
        ring: Ring,
        name: &str,
        measure: impl FnOnce(&Gpu, Policy) -> Result<Measured, Failure>,
    ) -> Result<&mut Row, Failure> {
        self.row(ring, name, None, measure)
    }

    /// Adds a control: the same comparison, with something wrong on purpose.
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
    ) -> Result<&mut Row, Failure> {
        self.table.working_on(&format!("{}: {name}", ring.name()));
        let found = measure(&self.gpu, self.policy).map_err(|error| error.to_string());
        let adapter = &self.gpu.adapter().name;
        Ok(self.table.add(&Subject { ring, name, adapter, control }, found)?)
    }
}
