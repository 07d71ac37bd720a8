// What one picture shows: prepared by the host in double precision, so that nothing here depends on where the origin lies.

struct View {
    // Index per step of a ray.
    step: vec3f,
    threshold_hu: f32,
    // 1/step; where the step is 0, anything.
    steps_per_index: vec3f,
    // 0 without ambient occlusion.
    occlusion: f32,
    // Rows of world direction → index, for a length of the finest spacing.
    index_per_spacing: array<vec4f, 3>,
    // World directions: to the viewer, to the light, and half-way between.
    toward: vec3f,
    depth_slope: f32,
    light: vec3f,
    depth_intercept: f32,
    half_way: vec3f,
    depth_spacing_mm: f32,
    // Linear light.
    skin: vec3f,
    // 1/thickness of the skin.
    skins_per_mm: f32,
    // Linear light of tissue; w is its HU, rising.
    tissue: array<vec4f, 6>,
    // World directions in which ambient light is looked for; as index offsets as long as the occlusion's reach.
    directions: array<vec4f, 16>,
    reaches: array<vec4f, 16>,
    // Rows of index of the volume → index of the depth volume; of world direction → index of the depth volume, for a length
    // of its finest spacing.
    depth_index: array<vec4f, 3>,
    depth_per_spacing: array<vec4f, 3>,
}

@group(0) @binding(2) var<uniform> view: View;

// The linear map with these rows.
fn turn(rows: array<vec4f, 3>, v: vec3f) -> vec3f {
    return vec3f(dot(rows[0].xyz, v), dot(rows[1].xyz, v), dot(rows[2].xyz, v));
}
