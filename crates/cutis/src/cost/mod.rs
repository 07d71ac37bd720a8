//! The cost of a run. `cutis check` counts and measures it before a run. The report of a run has
//! the measured cost of each part.

mod cost_report;
mod left_out;
mod odd_values;
mod plan;

pub use cost_report::{CostPart, CostReport};
pub use plan::{Plan, check};
