//! Tests of the constraints: gradients, conservation, precision, SIMD lanes, degenerate shapes,
//! stability, materials, skin strips, and the numbers of the errata page.
#![allow(clippy::print_stdout)] // measured values for runs with --nocapture

mod checks;
mod degenerate;
mod errata;
mod gradients;
mod lanes;
mod material;
mod precision;
mod projection;
mod shapes;
mod stability;
mod strip_energy;
mod strip_rest;
mod strip_settle;
mod strip_stability;
mod strips;
