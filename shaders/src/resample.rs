//! The passes of the resampler over a mesh and over the slabs of a volume.

use crate::link;

const GRID: &str = include_str!("../wgsl/resample/grid.wgsl");
const TET: &str = include_str!("../wgsl/resample/tet.wgsl");
const BOX: &str = include_str!("../wgsl/resample/box.wgsl");
const WALK: &str = include_str!("../wgsl/resample/walk.wgsl");

/// The name of the entry point of [`place`].
pub const PLACE: &str = "place";
/// The entry point of [`span`] for tets that exist now.
pub const SPAN: &str = "span";
/// The entry point of [`span`] for tets that were removed.
pub const SPAN_REMOVED: &str = "span_removed";
/// The name of the entry point of [`clear`].
pub const CLEAR: &str = "clear";
/// The entry point of [`claim`] and [`vacate`] that gives each tet a thread.
pub const WALK_ALL: &str = "walk";
/// The entry point of [`claim`] and [`vacate`] that gives each large tet a workgroup.
pub const WALK_LARGE: &str = "walk_large";
/// The name of the entry point of [`gather`].
pub const GATHER: &str = "gather";

/// Positions of the vertices to places among the voxels.
pub fn place() -> String {
    link(&[GRID, include_str!("../wgsl/resample/place.wgsl")])
}

/// The slices that each tet comes near.
pub fn span() -> String {
    link(&[GRID, TET, BOX, include_str!("../wgsl/resample/span.wgsl")])
}

/// A slab as nobody has claimed it.
pub fn clear() -> String {
    link(&[GRID, include_str!("../wgsl/resample/clear.wgsl")])
}

/// Deformed tets claim voxels.
pub fn claim() -> String {
    link(&[GRID, TET, BOX, WALK, include_str!("../wgsl/resample/claim.wgsl")])
}

/// Tets at rest mark the voxels that the body may have left.
pub fn vacate() -> String {
    link(&[GRID, TET, BOX, WALK, include_str!("../wgsl/resample/vacate.wgsl")])
}

/// Voxels take their values.
pub fn gather() -> String {
    link(&[GRID, TET, include_str!("../wgsl/resample/gather.wgsl")])
}
