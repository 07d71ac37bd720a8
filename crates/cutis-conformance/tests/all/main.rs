//! The battery passes the constraint types of Cutis and rejects wrong ones. Strips at rest hold the
//! scan on all backends.

mod at_rest;
mod builtin;
mod rejects;
mod skipped;
mod wrong;
