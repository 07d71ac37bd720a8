//! The checks on a GPU, and the choice of the GPU.
//!
//! A device may deviate from `f64` at most [`ALLOWANCE`] times as much as the CPU does in `f32`, in
//! the worst case and in the root mean square. The CPU is assumed to deviate by at least two ulp.
//! The tolerance therefore follows from the formula of the constraint. On a software adapter, which
//! rounds as the CPU does, every number must be equal.

mod degenerate;
mod evaluation;
mod policy;
mod projection;

use cutis_gpu::{AdapterKind, Gpu};

use crate::Report;

pub use degenerate::degenerate;
pub use evaluation::evaluation;
pub use policy::{REQUIRE, open};
pub use projection::projection;

pub use crate::measure::ALLOWANCE;

/// Returns whether the adapter rounds as the CPU does, so that every number must be equal.
pub(crate) fn is_exact(gpu: &Gpu) -> bool {
    gpu.adapter().kind == AdapterKind::Software
}

pub(crate) fn report(constraint: &'static str, check: &'static str, gpu: &Gpu) -> Report {
    Report { adapter: Some(gpu.adapter().name.clone()), ..Report::new(constraint, check) }
}
