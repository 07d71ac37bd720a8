//! Test battery for constraint types: one line holds a type of one's own, in Rust and in WGSL, to what solvers rely on.
//!
//! ```
//! use cutis_constraints::Distance;
//!
//! cutis_conformance::conformance!(Distance, 2); // a module of tests
//! ```
//!
//! # What is checked
//!
//! | check | what holds | what it must see (control) |
//! |---|---|---|
//! | [`gradient`](checks::gradient) | `∇C` is the gradient of `C` | a gradient off by 1e-3; two swapped |
//! | [`momentum`](checks::momentum) | gradients sum to zero and make no torque | one off by 1e-3; a couple |
//! | [`scale`](checks::scale) | no length and no epsilon of its own | a micrometer |
//! | [`parameters`](checks::parameters) | each parameter matters in the samples | (it is one: an idle parameter fails) |
//! | [`precision`](checks::precision) | `f32` is near `f64` | value or gradient off by 1e-3 |
//! | [`lanes`](checks::lanes) | a SIMD lane has the bits of the scalar | the lane beside |
//! | [`degenerate`](checks::degenerate) | collapsed shapes stay finite | a division by zero |
//! | [`wgsl`](checks::wgsl) | the shader is valid, `Params` is laid out as on the host | an unknown name, one parameter more, `normalize` |
//! | [`projection`](checks::projection) | threads give the bits of the reference | value or gradient off by 1e-3 |
//! | [`device::evaluation`] | the shader computes what Rust does | the shader off by 1e-3; gradients swapped |
//! | [`device::projection`] | the GPU backend lands where the reference does | value or gradient off by 1e-3 |
//! | [`device::degenerate`] | collapsed shapes stay finite on the device | the exponent of infinity |
//!
//! Samples are random shapes at 1 mm, 1 m and 1 km, the same in every run. Everything is compared with `f64`, and **each check
//! contains negative controls**: the same comparison must reject something that is wrong on purpose, or the check fails.
//! How far a device may be off is not a constant: see [`device`].
//!
//! The checks are functions that return a [`Report`], so that other programs can print the figures:
//! ```
//! use cutis_conformance::{Outcome, Subject, checks};
//! use cutis_constraints::Volume;
//!
//! let report = checks::gradient(&Subject::<Volume, 4>::default());
//! assert_eq!(report.outcome(), Outcome::Passed);
//! assert!(report.rows.iter().any(|row| row.is_control()));
//! ```
#![forbid(unsafe_code)]

pub mod checks;
pub mod device;
pub mod shapes;

mod alter;
mod body;
mod error;
mod macros;
mod measure;
mod random;
mod report;
mod subject;

pub use alter::{Alteration, FACTOR};
pub use error::ConformanceError;
pub use measure::{Deviation, Errors, errors};
pub use random::Random;
pub use report::{Limit, Outcome, Report, Row};
pub use subject::{Case, SCALES, Subject};

use cutis_constraints::Constraint;
use cutis_gpu::Gpu;

/// All checks that need no device.
///
/// # Errors
/// As for [`checks::projection`].
pub fn on_host<C: Constraint<N>, const N: usize>(
    subject: &Subject<C, N>,
) -> Result<Vec<Report>, ConformanceError> {
    Ok(vec![
        checks::gradient(subject),
        checks::momentum(subject),
        checks::scale(subject),
        checks::parameters(subject),
        checks::precision(subject),
        checks::lanes(subject),
        checks::degenerate(subject),
        checks::wgsl(subject),
        checks::projection(subject)?,
    ])
}

/// All checks on a device.
///
/// # Errors
/// As for the functions in [`device`].
pub fn on_device<C: Constraint<N>, const N: usize>(
    subject: &Subject<C, N>,
    gpu: &Gpu,
) -> Result<Vec<Report>, ConformanceError> {
    Ok(vec![
        device::evaluation(subject, gpu)?,
        device::projection(subject, gpu)?,
        device::degenerate(subject, gpu)?,
    ])
}

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
