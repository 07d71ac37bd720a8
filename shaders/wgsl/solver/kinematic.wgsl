// Moves the vertices of handles along their paths. The same operations as
// `KinematicHandle::advance`.
struct KinematicHandle {
    // Position at which the vertex was grabbed.
    start: vec3f,
    vertex: u32,
}

struct Frame {
    // Number of substeps between the reset of the status and the start of this frame.
    first_substep: u32,
    // Number of handles.
    handles: u32,
}

@group(0) @binding(0) var<storage, read_write> vertices: array<vec4f>;
// The first vertex that is not finite, and the number of finite substeps.
@group(0) @binding(1) var<storage, read> status: array<u32>;
@group(0) @binding(2) var<uniform> frame: Frame;
// Displacement of each handle at the end of each substep of the frame.
@group(0) @binding(3) var<storage, read> paths: array<vec4f>;
@group(1) @binding(0) var<storage, read> handles: array<KinematicHandle>;
// Index of the handle of each vertex.
@group(1) @binding(1) var<storage, read> owners: array<u32>;

@compute @workgroup_size(64)
fn kinematic(@builtin(global_invocation_id) id: vec3u) {
    let k = id.x;
    if (k >= arrayLength(&handles)) {
        return;
    }
    let handle = handles[k];
    let substep = max(status[1], frame.first_substep) - frame.first_substep;
    let path = paths[substep * frame.handles + owners[k]].xyz;
    vertices[handle.vertex] = vec4f(handle.start + path, vertices[handle.vertex].w);
}
