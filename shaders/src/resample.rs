//! The passes of the resampler over a mesh and over the slabs of a volume.

use crate::link;

const GRID: &str = include_str!("../wgsl/resample/grid.wgsl");
const TET: &str = include_str!("../wgsl/resample/tet.wgsl");
const BOX: &str = include_str!("../wgsl/resample/box.wgsl");
const MESH: &str = include_str!("../wgsl/resample/mesh.wgsl");
const WALK: &str = include_str!("../wgsl/resample/walk.wgsl");

/// Name of the entry point of [`place`].
pub const PLACE: &str = "place";
/// Name of the entry point of [`span`] for the present tets.
pub const SPAN: &str = "span";
/// Name of the entry point of [`span`] for removed tets.
pub const SPAN_REMOVED: &str = "span_removed";
/// Name of the entry point of [`clear`].
pub const CLEAR: &str = "clear";
/// Name of the entry point of [`claim`] and [`vacate`] with one thread per tet.
pub const WALK_ALL: &str = "walk";
/// Name of the entry point of [`claim`] and [`vacate`] with one workgroup per large tet.
pub const WALK_LARGE: &str = "walk_large";
/// Name of the entry point of [`gather`].
pub const GATHER: &str = "gather";

/// Returns the source that maps the positions of vertices to places among the voxels.
pub fn place() -> String {
    link(&[GRID, include_str!("../wgsl/resample/place.wgsl")])
}

/// Returns the source that computes the slices that each tet touches.
pub fn span() -> String {
    link(&[GRID, TET, BOX, MESH, include_str!("../wgsl/resample/span.wgsl")])
}

/// Returns the source that resets a slab.
pub fn clear() -> String {
    link(&[GRID, include_str!("../wgsl/resample/clear.wgsl")])
}

/// Returns the source with which deformed tets claim voxels.
pub fn claim() -> String {
    link(&[GRID, TET, BOX, MESH, WALK, include_str!("../wgsl/resample/claim.wgsl")])
}

/// Returns the source with which tets at rest mark the voxels that the body may have left.
pub fn vacate() -> String {
    link(&[GRID, TET, BOX, MESH, WALK, include_str!("../wgsl/resample/vacate.wgsl")])
}

/// Returns the source that computes the values of voxels.
pub fn gather() -> String {
    link(&[GRID, TET, MESH, include_str!("../wgsl/resample/gather.wgsl")])
}
