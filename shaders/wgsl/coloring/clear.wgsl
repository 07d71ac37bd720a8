// Prepares the vertices for a round, or for the next colors.
@group(0) @binding(0) var<storage, read_write> highest: array<u32>;
@group(0) @binding(1) var<storage, read_write> masks: array<vec4u>;

@compute @workgroup_size(64)
fn clear_highest(@builtin(global_invocation_id) id: vec3u) {
    if (id.x < arrayLength(&highest)) {
        highest[id.x] = 0u;
    }
}

@compute @workgroup_size(64)
fn clear_masks(@builtin(global_invocation_id) id: vec3u) {
    if (id.x < arrayLength(&masks)) {
        masks[id.x] = vec4u(0u);
    }
}
