//! The `cutis` program.
fn main() {}
