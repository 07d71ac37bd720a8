//! The constraints of `cutis-constraints`. Each source has a `struct Params` and a function `eval`.

/// Source of `Distance`, with two vertices.
pub const DISTANCE: &str = include_str!("../wgsl/constraints/distance.wgsl");
/// Source of `Volume`, with four vertices.
pub const VOLUME: &str = include_str!("../wgsl/constraints/volume.wgsl");
/// Source of `Thread`, with six vertices.
pub const THREAD: &str = include_str!("../wgsl/constraints/thread.wgsl");
/// Source of `LipContact`, with four vertices.
pub const LIP_CONTACT: &str = include_str!("../wgsl/constraints/lip_contact.wgsl");
/// Source of `LipAdhesion`, with four vertices.
pub const LIP_ADHESION: &str = include_str!("../wgsl/constraints/lip_adhesion.wgsl");
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
/// Source of `SkinStrip`, with three vertices.
pub const SKIN_STRIP: &str = concat!(
    include_str!("../wgsl/constraints/strip.wgsl"),
    "\n",
    include_str!("../wgsl/constraints/strip_params.wgsl"),
    "\n",
    include_str!("../wgsl/constraints/skin_strip.wgsl")
);
/// Source of `SkinStripAtRest`, with three vertices.
pub const SKIN_STRIP_AT_REST: &str = concat!(
    include_str!("../wgsl/constraints/strip.wgsl"),
    "\n",
    include_str!("../wgsl/constraints/strip_params.wgsl"),
    "\n",
    include_str!("../wgsl/constraints/skin_strip_at_rest.wgsl")
);
/// Source of `SkinStripTurn`, with three vertices.
pub const SKIN_STRIP_TURN: &str = concat!(
    include_str!("../wgsl/constraints/strip.wgsl"),
    "\n",
    include_str!("../wgsl/constraints/skin_strip_turn.wgsl")
);
