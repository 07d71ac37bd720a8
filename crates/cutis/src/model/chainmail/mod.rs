//! The model `chainmail`: links between lattice points, which give way up to a limit.

pub(crate) mod chain;
mod run;

pub(crate) use run::Chained;
