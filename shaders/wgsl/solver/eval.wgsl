// The result of a constraint, and functions that its `eval` may call. `N`, the number of vertices,
// is declared above.
struct Eval {
    c: f32,
    grad: array<vec3f, N>,
}

// 1/r² for the largest distance r of a projection along the gradient. An `eval` may set it. Zero
// means no limit.
var<private> inverse_reach_squared: f32;

// True if every gradient has the length 1 wherever it is defined. An `eval` may set it. It then
// also sets vectors in the directions of the gradients, and their length.
var<private> unit_gradients: bool;
var<private> along: array<vec3f, N>;
var<private> along_length: f32;

// Always zero, but compilers cannot know it: entry points set it to 1 if there are no constraints.
var<private> hidden_zero: u32;

// Returns the value unchanged, in a form that optimizers cannot analyze. Drivers replace
// `a * b + a * c` by `a * (b + c)`, which rounds differently. They cannot do so with
// `exact(a * b)`.
fn exact(value: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(value) | hidden_zero);
}

fn exact3(value: vec3f) -> vec3f {
    return bitcast<vec3f>(bitcast<vec3u>(value) | vec3u(hidden_zero));
}
