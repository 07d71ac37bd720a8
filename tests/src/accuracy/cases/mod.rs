//! The problems: bodies, how they move, and what is looked at.

pub mod block;
pub mod scene;
pub mod sheet;

use cutis_solver::{Settings, System};
use nalgebra::Point3;

use super::Failure;

/// Measures the opening of a wound, in the unit that the name says.
pub type Measure = Box<dyn Fn(&[Point3<f64>]) -> f64>;

/// A problem.
pub struct Case {
    /// In the table and on the command line.
    pub name: &'static str,
    /// In words.
    pub what: String,
    /// The body with compliances.
    pub xpbd: System<f32>,
    /// The same with PBD's stiffness, where that stands for anything.
    pub pbd: Option<System<f32>>,
    /// Frame, outer forces and damping; substeps and iterations are the configuration's.
    pub settings: Settings,
    /// Frames after which an implicit substep is compared (E1).
    pub instants: Vec<u32>,
    /// Frame at which the trajectory is compared (E2).
    pub compared_at: u32,
    /// Frames after which the body counts as settled (E3), unless it was earlier.
    pub most_frames: u32,
    /// The opening of the wound, and its unit.
    pub opening: Option<(Measure, &'static str)>,
}

/// The names of all problems, in order.
pub const NAMES: [&str; 6] = ["sheet", "incision", "abdomen", "block", "hanging", "drag"];

/// Those that `--quick` runs, unless it is told which.
pub const QUICK: [&str; 3] = ["sheet", "incision", "hanging"];

/// Those on which accelerations are tried, unless it is told which.
pub const TRIED: [&str; 2] = ["incision", "block"];

/// The problem of that name; none, with a printed reason, where its data are absent. `quick` ones are smaller.
///
/// # Errors
/// What the builders refuse, and a name that is none of [`NAMES`].
pub fn named(name: &str, quick: bool) -> Result<Option<Case>, Failure> {
    let block_size = if quick { [9, 4, 4] } else { [25, 9, 9] };
    match name {
        "sheet" => sheet::wound(if quick { 20 } else { 60 }).map(Some),
        "incision" => scene::incision(if quick { 25.0 } else { 12.0 }).map(Some),
        "abdomen" => scene::abdomen(if quick { 25.0 } else { 14.0 }),
        "block" => block::pulled(block_size).map(Some),
        "hanging" => block::hanging(block_size).map(Some),
        "drag" => scene::drag(if quick { 25.0 } else { 12.0 }).map(Some),
        other => Err(format!("no problem is called `{other}`; there are {}", NAMES.join(", ")).into()),
    }
}
