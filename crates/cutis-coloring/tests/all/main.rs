//! Tests of the colorings of constraints and of vertices.

mod constraints;
mod vertices;
