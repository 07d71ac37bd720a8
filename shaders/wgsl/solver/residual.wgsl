// Value over rest size of a chunk of constraints: the sum of squares and the largest absolute value
// per workgroup.
@group(0) @binding(0) var<storage, read> vertices: array<vec4f>;
@group(1) @binding(0) var<storage, read> tuples: array<array<u32, N>>;
@group(1) @binding(1) var<storage, read> params: array<Params>;
// Zero for constraints with a rest size of zero.
@group(1) @binding(2) var<storage, read> inverse_rest_size: array<f32>;
@group(1) @binding(3) var<storage, read_write> workgroup_sums: array<vec2f>;

var<workgroup> sums: array<vec2f, 64>;

@compute @workgroup_size(64)
fn residual(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(local_invocation_index) local: u32,
    @builtin(workgroup_id) group: vec3u,
) {
    let k = id.x;
    var ratio = 0.0;
    if (k < arrayLength(&tuples)) {
        var tuple = tuples[k];
        var x: array<vec3f, N>;
        for (var i = 0u; i < N; i++) {
            x[i] = vertices[tuple[i]].xyz;
        }
        hidden_zero = select(0u, 1u, arrayLength(&tuples) == 0u);
        ratio = abs(eval(x, params[k]).c * inverse_rest_size[k]);
    }
    sums[local] = vec2f(ratio * ratio, ratio);
    for (var half = 32u; half > 0u; half = half / 2u) {
        workgroupBarrier();
        if (local < half) {
            let other = sums[local + half];
            sums[local] = vec2f(sums[local].x + other.x, max(sums[local].y, other.y));
        }
    }
    if (local == 0u) {
        workgroup_sums[group.x] = sums[0];
    }
}
