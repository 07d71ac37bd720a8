// The passes over vertices: prediction, velocity update, both combined, the check for finite
// positions, and the reset. The same operations as `Integrator::run`.
//
// `check` stores the first vertex whose position is not finite. After that no pass of the step
// overwrites `previous`, so that `restore` resets the state to the start of that substep.
struct Status {
    // The first vertex that is not finite, or NONE.
    vertex: atomic<u32>,
    // Number of substeps with a finite result.
    substeps: u32,
    // 1 once a substep has started after one that was not finite.
    failed: u32,
}

const NONE: u32 = 0xffffffffu;

@group(0) @binding(0) var<storage, read_write> vertices: array<vec4f>;
@group(0) @binding(1) var<storage, read_write> previous: array<vec4f>;
@group(0) @binding(2) var<storage, read_write> velocities: array<vec4f>;
@group(0) @binding(3) var<uniform> settings: Settings;
// Index of the first vertex of this part of the body.
@group(0) @binding(4) var<uniform> first: u32;
@group(0) @binding(5) var<storage, read_write> status: Status;

fn finished_velocity(i: u32) -> vec3f {
    return (vertices[i].xyz - previous[i].xyz) * settings.velocity_factor;
}

fn predict_from(i: u32, velocity: vec3f) {
    let vertex = vertices[i];
    previous[i] = vertex;
    if (vertex.w > 0.0) {
        let pushed = (velocity + settings.gravity_h) + load_of(i) * (vertex.w * settings.load_h);
        vertices[i] = vec4f(vertex.xyz + pushed * settings.h, vertex.w);
    }
}

// True if the result of the substep before is finite. The first thread counts the substep.
fn goes_on(i: u32) -> bool {
    let finite = atomicLoad(&status.vertex) == NONE;
    if (first + i == 0u) {
        if (finite) {
            status.substeps = status.substeps + 1u;
        } else {
            status.failed = 1u;
        }
    }
    return finite;
}

@compute @workgroup_size(64)
fn predict(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    if (i < arrayLength(&vertices)) {
        predict_from(i, velocities[i].xyz);
    }
}

// Runs after `finish` of the substep before.
@compute @workgroup_size(64)
fn predict_next(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    if (i < arrayLength(&vertices) && status.failed == 0u) {
        predict_from(i, velocities[i].xyz);
    }
}

@compute @workgroup_size(64)
fn finish_and_predict(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    if (i < arrayLength(&vertices) && goes_on(i)) {
        predict_from(i, finished_velocity(i));
    }
}

@compute @workgroup_size(64)
fn finish(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    if (i < arrayLength(&vertices) && goes_on(i)) {
        velocities[i] = vec4f(finished_velocity(i), 0.0);
    }
}

@compute @workgroup_size(64)
fn check(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    if (i < arrayLength(&vertices) && status.failed == 0u) {
        let x = vertices[i].xyz;
        if (!(is_finite(x.x) && is_finite(x.y) && is_finite(x.z))) {
            atomicMin(&status.vertex, first + i);
        }
    }
}

@compute @workgroup_size(64)
fn restore(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    if (i < arrayLength(&vertices)) {
        vertices[i] = previous[i];
        velocities[i] = vec4f(0.0);
    }
}
