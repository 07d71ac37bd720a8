// Hounsfield units of a volume at any position, by trilinear interpolation.

// Padding values below air count as air.
const AIR_HU: f32 = -1024.0;

// HU = slope · stored + intercept.
struct Scale {
    slope: f32,
    intercept: f32,
}

@group(0) @binding(0) var volume: texture_3d<i32>;
@group(0) @binding(1) var<uniform> volume_scale: Scale;

// HU of one voxel.
fn voxel(field: texture_3d<i32>, scale: Scale, index: vec3u) -> f32 {
    return max(scale.slope * f32(textureLoad(field, index, 0).x) + scale.intercept, AIR_HU);
}

// HU at a continuous index, clamped to the grid.
fn sample(field: texture_3d<i32>, scale: Scale, position: vec3f) -> f32 {
    let last = textureDimensions(field) - 1u;
    let inside = clamp(position, vec3f(0.0), vec3f(last));
    let whole = floor(inside);
    let part = inside - whole;
    let low = vec3u(whole);
    let high = min(low + 1u, last);
    var row: array<f32, 4>;
    for (var n = 0u; n < 4u; n++) {
        let y = select(low.y, high.y, (n & 1u) != 0u);
        let z = select(low.z, high.z, (n & 2u) != 0u);
        let from_hu = voxel(field, scale, vec3u(low.x, y, z));
        let to_hu = voxel(field, scale, vec3u(high.x, y, z));
        row[n] = from_hu + part.x * (to_hu - from_hu);
    }
    let near = row[0] + part.y * (row[1] - row[0]);
    let far = row[2] + part.y * (row[3] - row[2]);
    return near + part.z * (far - near);
}

// HU of the rendered volume.
fn hu_at(position: vec3f) -> f32 {
    return sample(volume, volume_scale, position);
}
