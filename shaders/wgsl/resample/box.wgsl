// The bounding box of a tet in voxels.

// Voxels of the region from `first` inclusive to `end` exclusive.
struct Box {
    first: vec3u,
    end: vec3u,
}

// The voxels whose centers can lie in the tet or within the tolerance. If there are none, `end` is
// zero.
fn box_of(p: Corners) -> Box {
    let region = vec3f(grid.region_x, grid.region_y, grid.region_z);
    let last = vec3f(f32(grid.columns - 1u), f32(grid.rows - 1u), f32(grid.slices - 1u));
    let low = min(min(p.a, p.b), min(p.c, p.d)) - vec3f(grid.tolerance);
    let high = max(max(p.a, p.b), max(p.c, p.d)) + vec3f(grid.tolerance);
    let first = max(ceil(low) - region, vec3f(0.0));
    let end = min(floor(high) - region, last);
    if any(first > end) {
        return Box(vec3u(0u), vec3u(0u));
    }
    return Box(vec3u(first), vec3u(end) + vec3u(1u));
}
