//! What a run costs. `cutis check` counts and measures before a run; the report of a run has the
//! measured cost of each part.

mod cost_report;
mod left_out;
mod plan;

pub use cost_report::{CostPart, CostReport};
pub use plan::{Plan, check};
