// What a constraint returns, and what its `eval` may call. `N`, the number of vertices, stands above.
struct Eval {
    c: f32,
    grad: array<vec3f, N>,
}
