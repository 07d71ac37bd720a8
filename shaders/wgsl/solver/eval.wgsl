// What a constraint returns, and what its `eval` may call. `N`, the number of vertices, stands above.
struct Eval {
    c: f32,
    grad: array<vec3f, N>,
}

// 1/r² with the longest way r on which a projection follows the gradient; an `eval` may set it. Zero: no limit.
var<private> inverse_reach_squared: f32;

// Zero, and no compiler can know: entry points set it to whether there are no constraints at all.
var<private> hidden_zero: u32;

// The value itself, behind a wall that optimizers do not see through. Drivers turn `a * b + a * c` into `a * (b + c)`, which
// rounds differently; `a` behind such a wall is not the same `a`.
fn exact(value: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(value) | hidden_zero);
}

fn exact3(value: vec3f) -> vec3f {
    return bitcast<vec3f>(bitcast<vec3u>(value) | vec3u(hidden_zero));
}
