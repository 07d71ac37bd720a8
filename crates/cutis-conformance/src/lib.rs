//! A test battery for constraint types: one line tests a type, in Rust and in WGSL, for everything
//! that solvers rely on.
//!
//! ```
//! use cutis_constraints::Distance;
//!
//! cutis_conformance::conformance!(Distance, 2); // a module of tests
//! ```
//!
//! # Checks
//!
//! | check | requirement | negative control |
//! |---|---|---|
//! | [`gradient`](checks::gradient) | `∇C` is the gradient of `C` | a gradient off by 1e-3; two swapped |
//! | [`momentum`](checks::momentum) | gradients sum to zero and have no torque | one off by 1e-3; a couple; the torque of an oriented constraint |
//! | [`scale`](checks::scale) | the formula contains no length and no epsilon | a length of 1e-20 m |
//! | [`parameters`](checks::parameters) | each parameter has an effect on the samples | (the check itself: a parameter without effect fails) |
//! | [`precision`](checks::precision) | `f32` is near `f64` | value or gradient off by 1e-3 |
//! | [`lanes`](checks::lanes) | a SIMD lane gives the same bits as scalar code | the next lane |
//! | [`degenerate`](checks::degenerate) | collapsed shapes stay finite | a division by zero |
//! | [`wgsl`](checks::wgsl) | the shader is valid, `Params` has the layout of the host | an unknown name, an extra parameter, `normalize` |
//! | [`projection`](checks::projection) | threads give the bits of the reference | value or gradient off by 1e-3 |
//! | [`device::evaluation`] | the shader computes the same as the Rust code | the shader off by 1e-3; gradients swapped |
//! | [`device::projection`] | the GPU backend agrees with the reference | value or gradient off by 1e-3 |
//! | [`device::degenerate`] | collapsed shapes stay finite on the device | the exponent of infinity |
//!
//! The samples are random shapes at 1 mm, 1 m and 1 km, the same in every run. All results are
//! compared with `f64`. **Each check contains negative controls**: the same comparison must reject
//! a deliberate error, or the check fails. The tolerance of a device is not a constant: see
//! [`device`].
//!
//! The checks are functions that return a [`Report`], so that other programs can print the numbers:
//! ```
//! use cutis_conformance::{Subject, Verdict, checks};
//! use cutis_constraints::Volume;
//!
//! let report = checks::gradient(&Subject::<Volume, 4>::default());
//! assert_eq!(report.verdict(), Verdict::Passed);
//! assert!(report.findings.iter().any(|finding| finding.is_control()));
//! ```
#![forbid(unsafe_code)]

mod alteration;
pub mod checks;
pub mod device;
mod error;
mod macros;
mod measure;
mod random;
mod report;
mod shapes;
mod subject;
mod test_body;

pub use alteration::{Alteration, FACTOR};
pub use error::ConformanceError;
pub use report::{Finding, Limit, Report, Verdict};
pub use subject::{Case, Subject};

use cutis_constraints::Constraint;
use cutis_gpu::Gpu;
use subject::SCALES;

/// Runs all checks that need no device.
///
/// # Errors
/// The errors of [`checks::projection`].
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

/// Runs all checks on a device.
///
/// # Errors
/// The errors of the functions in [`device`].
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
