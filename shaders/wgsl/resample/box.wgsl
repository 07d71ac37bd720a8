// The voxels that a tet can hold.

// Voxels of the region, `first` included, `end` not.
struct Box {
    first: vec3u,
    end: vec3u,
}

// The voxels that can lie in the tet or come near it; `end` is zero where there are none.
fn box_of(a: vec3f, b: vec3f, c: vec3f, d: vec3f) -> Box {
    let region = vec3f(grid.region_x, grid.region_y, grid.region_z);
    let last = vec3f(f32(grid.columns - 1u), f32(grid.rows - 1u), f32(grid.slices - 1u));
    let low = min(min(a, b), min(c, d)) - vec3f(grid.tolerance);
    let high = max(max(a, b), max(c, d)) + vec3f(grid.tolerance);
    let first = max(ceil(low) - region, vec3f(0.0));
    let end = min(floor(high) - region, last);
    if any(first > end) {
        return Box(vec3u(0u), vec3u(0u));
    }
    return Box(vec3u(first), vec3u(end) + vec3u(1u));
}
