// Values and gradients of constraints, for tests. Each constraint has `N` consecutive positions.
@group(0) @binding(0) var<storage, read> points: array<vec4f>;
@group(0) @binding(1) var<storage, read> params: array<Params>;
// `N` vectors per constraint: the gradients, with the value as fourth component.
@group(0) @binding(2) var<storage, read_write> found: array<vec4f>;

@compute @workgroup_size(64)
fn evaluate(@builtin(global_invocation_id) id: vec3u) {
    let k = id.x;
    if (k >= arrayLength(&params)) {
        return;
    }
    var x: array<vec3f, N>;
    for (var i = 0u; i < N; i++) {
        x[i] = points[k * N + i].xyz;
    }
    hidden_zero = select(0u, 1u, arrayLength(&params) == 0u);
    var done = eval(x, params[k]);
    for (var i = 0u; i < N; i++) {
        found[k * N + i] = vec4f(done.grad[i], done.c);
    }
}
