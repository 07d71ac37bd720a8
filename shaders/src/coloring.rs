//! The coloring of constraints over any mesh.

use crate::link;

/// Entry point of [`color`]: each constraint writes its priority to its vertices.
pub const PROPOSE: &str = "propose";
/// Entry point of [`color`]: the constraints with the highest priority take colors.
pub const CHOOSE: &str = "choose";
/// Entry point of [`color`]: deferred constraints are left again.
pub const RESUME: &str = "resume";
/// Entry point of [`clear`]: no constraint has a priority.
pub const CLEAR_HIGHEST: &str = "clear_highest";
/// Entry point of [`clear`]: no color is taken.
pub const CLEAR_MASKS: &str = "clear_masks";
/// Number of colors of the masks.
pub const MASK_COLORS: u32 = 128;
/// The color of a constraint that has none yet.
pub const LEFT: u32 = u32::MAX;

/// Returns the source of the passes over constraints.
pub fn color() -> String {
    link(&[include_str!("../wgsl/coloring/color.wgsl")])
}

/// Returns the source of the passes over vertices.
pub fn clear() -> String {
    link(&[include_str!("../wgsl/coloring/clear.wgsl")])
}

/// The priority of a constraint with this number, as [`color`] computes it: a permutation of the
/// numbers of 32 bits.
pub fn priority(number: u32) -> u32 {
    let mut x = number;
    x = (x ^ x >> 16).wrapping_mul(0x7feb_352d);
    x = (x ^ x >> 15).wrapping_mul(0x846c_a68b);
    x ^ x >> 16
}
