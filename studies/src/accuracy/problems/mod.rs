//! The problems: bodies, their motion, and the frames of comparison.

pub mod block;
pub mod membrane;
pub mod scene;
pub mod sheet;

use anyhow::bail;
use cutis_solver::{Settings, System};
use nalgebra::Point3;

use super::Failure;
use crate::at_rest;

/// A function that measures the opening of a wound.
pub type Opening = Box<dyn Fn(&[Point3<f64>]) -> f64>;

/// A problem.
pub struct Problem {
    /// Name in tables and on the command line.
    pub name: &'static str,
    /// Description.
    pub what: String,
    /// The body with compliances, for XPBD and the references.
    pub xpbd: System<f32>,
    /// The body for vertex block descent, if it needs other constraints. It has the same energy up
    /// to a constant.
    pub vbd: Option<System<f32>>,
    /// The body with the stiffness of PBD, if the problem has one.
    pub pbd: Option<System<f32>>,
    /// Time step, outer forces and damping. Substeps and iterations come from the configuration.
    pub settings: Settings,
    /// Frames after which an implicit substep is compared for E1.
    pub instants: Vec<u32>,
    /// Frame at which the trajectory is compared for E2.
    pub compared_at: u32,
    /// Largest number of frames until the body is compared at rest for E3.
    pub most_frames: u32,
    /// Opening of the wound and its unit.
    pub opening: Option<(Opening, &'static str)>,
    /// True if only few settings run.
    pub few_settings: bool,
}

/// The names of the problems of the main part of the page, in order.
pub const NAMES: [&str; 6] = ["sheet", "incision", "abdomen", "block", "hanging", "drag"];

/// The problem that has its own part of the page.
pub const MEMBRANE: &str = "membrane";

/// The problems of `--quick`.
pub const QUICK: [&str; 3] = ["sheet", "incision", "hanging"];

/// The problem of a name; a smaller one if `quick`. `None` if its scan is missing; the reason is
/// printed.
///
/// # Errors
/// The builder refuses the problem, or there is no problem of this name.
pub fn named(name: &str, quick: bool) -> Result<Option<Problem>, Failure> {
    let block_size = if quick { [9, 4, 4] } else { [25, 9, 9] };
    match name {
        "sheet" => sheet::wound(if quick { 20 } else { 60 }).map(Some),
        "incision" => scene::incision(if quick { 25.0 } else { 12.0 }).map(Some),
        "abdomen" => scene::abdomen(if quick { 25.0 } else { 14.0 }),
        "block" => block::pulled(block_size).map(Some),
        "hanging" => block::hanging(block_size).map(Some),
        "drag" => scene::drag(if quick { 25.0 } else { 12.0 }).map(Some),
        MEMBRANE => membrane::wound(if quick { [9, 9, 4] } else { at_rest::block::SIZE }).map(Some),
        other => bail!("there is no problem `{other}`; choose one of {}", NAMES.join(", ")),
    }
}
