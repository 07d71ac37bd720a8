// Projects a chunk of one color of one kind. Two of its constraints never share a vertex. The same
// operations as `project`.
@group(0) @binding(0) var<storage, read_write> vertices: array<vec4f>;
@group(0) @binding(1) var<uniform> settings: Settings;
@group(1) @binding(0) var<storage, read> tuples: array<array<u32, N>>;
@group(1) @binding(1) var<storage, read> params: array<Params>;

@compute @workgroup_size(64)
fn project(@builtin(global_invocation_id) id: vec3u) {
    let k = id.x;
    if (k >= arrayLength(&tuples)) {
        return;
    }
    var tuple = tuples[k];
    var x: array<vec3f, N>;
    var w: array<f32, N>;
    for (var i = 0u; i < N; i++) {
        let vertex = vertices[tuple[i]];
        x[i] = vertex.xyz;
        w[i] = vertex.w;
    }
    hidden_zero = select(0u, 1u, arrayLength(&tuples) == 0u);
    var found = eval(x, params[k]);
    for (var i = 0u; i < N; i++) {
        if (unit_gradients) {
            found.grad[i] = exact3(along[i]);
        } else {
            found.grad[i] = exact3(found.grad[i]);
        }
    }
    var weighted_square = 0.0;
    for (var i = 0u; i < N; i++) {
        let square = select(dot(found.grad[i], found.grad[i]), 1.0, unit_gradients);
        weighted_square = weighted_square + w[i] * square;
    }
    var lightest = 0.0;
    for (var i = 0u; i < N; i++) {
        lightest = max(lightest, w[i]);
    }
    weighted_square = max(weighted_square, lightest * (found.c * inverse_reach_squared * found.c));
    let multiplier = multiplier_of(k);
    let fraction = multiplier_fraction(found.c, weighted_square, stiffness_of(k), multiplier);
    let length = select(1.0, along_length, unit_gradients);
    let change = quotient_or_zero(fraction.x, fraction.y * length);
    keep_multiplier(k, multiplier + exact(change * length));
    for (var i = 0u; i < N; i++) {
        vertices[tuple[i]] = vec4f(x[i] + found.grad[i] * (w[i] * change), w[i]);
    }
}
