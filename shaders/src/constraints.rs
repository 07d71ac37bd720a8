//! The constraints of `cutis-constraints`. Each source has a `struct Params` and a function `eval`.

/// Source of `Distance`, with two vertices.
pub const DISTANCE: &str = include_str!("../wgsl/constraints/distance.wgsl");
/// Source of `Volume`, with four vertices.
pub const VOLUME: &str = include_str!("../wgsl/constraints/volume.wgsl");
/// Source of `SkinTension`, with three vertices.
pub const SKIN_TENSION: &str = concat!(
    include_str!("../wgsl/constraints/triangle.wgsl"),
    "\n",
    include_str!("../wgsl/constraints/skin_tension.wgsl")
);
/// Source of `SkinTensionPaper`, with three vertices.
pub const SKIN_TENSION_PAPER: &str = concat!(
    include_str!("../wgsl/constraints/triangle.wgsl"),
    "\n",
    include_str!("../wgsl/constraints/skin_tension_paper.wgsl")
);
