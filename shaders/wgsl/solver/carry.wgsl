// Carries the vertices of handles along their paths. The twin of `Handle`'s way of moving.
struct Carried {
    rest: vec3f,
    vertex: u32,
}

@group(0) @binding(0) var<storage, read_write> vertices: array<vec4f>;
@group(1) @binding(0) var<storage, read> carried: array<Carried>;
@group(1) @binding(1) var<storage, read> handles: array<u32>;
// One per handle and substep: how far it has come.
@group(2) @binding(0) var<storage, read> paths: array<vec4f>;

@compute @workgroup_size(64)
fn carry(@builtin(global_invocation_id) id: vec3u) {
    let k = id.x;
    if (k >= arrayLength(&carried)) {
        return;
    }
    let one = carried[k];
    vertices[one.vertex] = vec4f(one.rest + paths[handles[k]].xyz, vertices[one.vertex].w);
}
