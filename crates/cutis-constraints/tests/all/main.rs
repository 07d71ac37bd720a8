//! Tests of the constraints: gradients, conservation, precision, lanes, degenerate shapes, stability, materials.

mod checks;
mod degenerate;
mod gradients;
mod lanes;
mod material;
mod precision;
mod projection;
mod shapes;
mod stability;
