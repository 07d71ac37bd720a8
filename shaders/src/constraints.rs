//! The constraints of `cutis-constraints`: each a `struct Params` and a function `eval`.

/// `Distance`, two vertices.
pub const DISTANCE: &str = include_str!("../wgsl/constraints/distance.wgsl");
/// `Volume`, four vertices.
pub const VOLUME: &str = include_str!("../wgsl/constraints/volume.wgsl");
/// `SkinTension`, three vertices.
pub const SKIN_TENSION: &str = concat!(
    include_str!("../wgsl/constraints/triangle.wgsl"),
    "\n",
    include_str!("../wgsl/constraints/skin_tension.wgsl")
);
/// `SkinTensionPaper`, three vertices.
pub const SKIN_TENSION_PAPER: &str = concat!(
    include_str!("../wgsl/constraints/triangle.wgsl"),
    "\n",
    include_str!("../wgsl/constraints/skin_tension_paper.wgsl")
);
