//! What a run costs: counted before it starts, measured while it runs, and planned by `cutis check`.

pub(crate) mod cost_report;
pub(crate) mod estimate;
mod model_costs;
pub(crate) mod plan;

pub use cost_report::{CostPart, CostReport};
pub use plan::{Plan, check};
