//! The battery passes the constraint types of Cutis and rejects wrong ones.

mod builtin;
mod rejects;
mod skipped;
mod wrong;
