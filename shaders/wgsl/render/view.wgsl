// The parameters of one picture. The host computes them in double precision, so that results do not
// depend on the origin of the coordinates.

struct View {
    // Index per step of a ray.
    step: vec3f,
    threshold_hu: f32,
    // 1/step. Unused where the step is 0.
    steps_per_index: vec3f,
    // 0 without ambient occlusion.
    occlusion: f32,
    // Rows of the map from a world direction to an index offset as long as the finest spacing.
    index_per_spacing: array<vec4f, 3>,
    // World directions: to the viewer, to the light, and halfway between.
    toward: vec3f,
    depth_slope: f32,
    light: vec3f,
    depth_intercept: f32,
    half_way: vec3f,
    depth_spacing_mm: f32,
    // Linear color of skin.
    skin: vec3f,
    // 1/thickness of the skin.
    skins_per_mm: f32,
    // Linear colors of tissue, with ascending HU as w.
    tissue: array<vec4f, 6>,
    // World directions of the ambient light, and the same as index offsets of the occlusion's
    // reach.
    directions: array<vec4f, 16>,
    reaches: array<vec4f, 16>,
    // Rows of the map from an index of the volume to an index of the depth volume, and of the map
    // from a world direction to an index offset of the depth volume as long as its finest spacing.
    depth_index: array<vec4f, 3>,
    depth_per_spacing: array<vec4f, 3>,
}

@group(0) @binding(2) var<uniform> view: View;

// The linear map with these rows.
fn turn(rows: array<vec4f, 3>, v: vec3f) -> vec3f {
    return vec3f(dot(rows[0].xyz, v), dot(rows[1].xyz, v), dot(rows[2].xyz, v));
}
