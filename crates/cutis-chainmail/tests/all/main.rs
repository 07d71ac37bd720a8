//! Integration tests of ChainMail.

mod examples;
mod figures;
#[cfg(feature = "gpu")]
mod gpu;
mod invariants;
mod oracle;
mod random;
