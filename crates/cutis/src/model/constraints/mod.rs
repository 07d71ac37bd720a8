//! The model `pbd`: constraints over the lattice, which a solver projects.

mod run;
pub(crate) mod system;

pub(crate) use run::Stepped;
