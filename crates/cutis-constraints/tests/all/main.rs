//! Tests of the constraints.
