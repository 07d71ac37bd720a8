//! What holds of every chain, and what the program's model does in the examples that it was described with.

mod examples;
mod figures;
mod invariants;
mod oracle;
mod random;
