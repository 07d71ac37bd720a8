//! The checks that need no device. Each is a function from a [`Subject`](crate::Subject) to a
//! [`Report`](crate::Report).

mod degenerate;
mod gradient;
mod lanes;
mod momentum;
mod parameters;
mod precision;
mod projection;
mod scale;
mod wgsl;

pub use degenerate::degenerate;
pub use gradient::gradient;
pub use lanes::lanes;
pub use momentum::momentum;
pub use parameters::parameters;
pub use precision::precision;
pub use projection::projection;
pub use scale::scale;
pub use wgsl::wgsl;

pub(crate) use degenerate::{degenerate_cases, finite};
pub(crate) use projection::bodies;
