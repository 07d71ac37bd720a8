// Carries the vertices of handles along their paths. The twin of `Handle`'s way of moving.
struct KinematicHandle {
    rest: vec3f,
    vertex: u32,
}

struct Frame {
    // Substeps that were done since the status was cleared when this frame began.
    first_substep: u32,
    // Number of handles.
    handles: u32,
}

@group(0) @binding(0) var<storage, read_write> vertices: array<vec4f>;
// First vertex that is not finite, substeps done.
@group(0) @binding(1) var<storage, read> status: array<u32>;
@group(0) @binding(2) var<uniform> frame: Frame;
// How far each handle has come at the end of each substep of the frame.
@group(0) @binding(3) var<storage, read> paths: array<vec4f>;
@group(1) @binding(0) var<storage, read> held: array<KinematicHandle>;
@group(1) @binding(1) var<storage, read> owners: array<u32>;

@compute @workgroup_size(64)
fn kinematic(@builtin(global_invocation_id) id: vec3u) {
    let k = id.x;
    if (k >= arrayLength(&held)) {
        return;
    }
    let one = held[k];
    let substep = max(status[1], frame.first_substep) - frame.first_substep;
    let path = paths[substep * frame.handles + owners[k]].xyz;
    vertices[one.vertex] = vec4f(one.rest + path, vertices[one.vertex].w);
}
