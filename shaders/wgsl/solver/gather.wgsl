// Collects the positions of some vertices, so that the host reads only those.
@group(0) @binding(0) var<storage, read> vertices: array<vec4f>;
@group(0) @binding(1) var<storage, read> wanted: array<u32>;
@group(0) @binding(2) var<storage, read_write> collected: array<vec4f>;

@compute @workgroup_size(64)
fn gather(@builtin(global_invocation_id) id: vec3u) {
    let k = id.x;
    if (k < arrayLength(&wanted)) {
        collected[k] = vertices[wanted[k]];
    }
}
