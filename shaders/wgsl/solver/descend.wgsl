// Moves the vertices of a chunk of one color and resets their forces to zero. The same operations
// as `DescentStep::moved`.
struct VertexForce {
    force: vec4f,
    diagonal: vec4f,
    mixed: vec4f,
}

// Constants of a substep, as in `DescentStep`.
struct Descent {
    gravity_h_squared: vec3f,
    h: f32,
    inverse_h_squared: f32,
    relaxation: f32,
}

@group(0) @binding(0) var<storage, read_write> vertices: array<vec4f>;
@group(0) @binding(1) var<storage, read_write> forces: array<VertexForce>;
@group(0) @binding(2) var<storage, read> previous: array<vec4f>;
@group(0) @binding(3) var<storage, read> velocities: array<vec4f>;
@group(0) @binding(4) var<uniform> descent: Descent;
@group(1) @binding(0) var<storage, read> indices: array<u32>;

// Four times the machine epsilon: the rounding error of a matrix over its trace.
const NOISE: f32 = 0x1p-21f;

fn finite_or_zero(value: f32) -> f32 {
    return select(0.0, value, is_finite(value));
}

@compute @workgroup_size(64)
fn descend(@builtin(global_invocation_id) id: vec3u) {
    if (id.x >= arrayLength(&indices)) {
        return;
    }
    let v = indices[id.x];
    let vertex = vertices[v];
    let found = forces[id.x];
    let inertia = descent.inverse_h_squared / vertex.w;
    let goal = (previous[v].xyz + velocities[v].xyz * descent.h) + descent.gravity_h_squared;
    let f = (found.force.xyz + load_of(v)) + (goal - vertex.xyz) * inertia;
    let d = found.diagonal.xyz;
    let least = max((d.x + d.y + d.z) * NOISE, inertia);
    let a = d + vec3f(least);
    let b = found.mixed.xyz;
    let l21 = b.x / a.x;
    let l31 = b.y / a.x;
    let d2 = max(a.y - l21 * b.x, least);
    let e = b.z - l21 * b.y;
    let l32 = e / d2;
    let d3 = max((a.z - l31 * b.y) - l32 * e, least);
    let y2 = f.y - l21 * f.x;
    let y3 = (f.z - l31 * f.x) - l32 * y2;
    let z3 = y3 / d3;
    let z2 = y2 / d2 - l32 * z3;
    let z1 = (f.x / a.x - l21 * z2) - l31 * z3;
    let step = vec3f(z1, z2, z3) * descent.relaxation;
    let finite = vec3f(finite_or_zero(step.x), finite_or_zero(step.y), finite_or_zero(step.z));
    vertices[v] = vec4f(vertex.xyz + finite, vertex.w);
    forces[id.x] = VertexForce(vec4f(0.0), vec4f(0.0), vec4f(0.0));
}
