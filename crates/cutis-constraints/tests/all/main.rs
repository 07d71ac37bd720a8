//! Tests of the constraints: gradients, conservation, precision, lanes, degenerate shapes, stability, materials.
#![allow(clippy::print_stdout)] // figures for whoever runs the test with --nocapture

mod checks;
mod degenerate;
mod gradients;
mod lanes;
mod material;
mod precision;
mod projection;
mod shapes;
mod stability;
