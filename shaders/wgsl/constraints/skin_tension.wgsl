// Skin tension, energy form. The same operations as `SkinTension::eval`.
struct Params {
    rest_area: f32,
    amplification: f32,
}

fn eval(x: array<vec3f, N>, p: Params) -> Eval {
    inverse_reach_squared = inverse_reach_squared_of(x, p.rest_area);
    var triangle = area_and_gradient(x);
    let c = triangle.area - p.rest_area;
    let q = sqrt(1.0 + ((2.0 / 3.0) * p.amplification) * stretch(c, p.rest_area));
    let slope = 1.5 * q - 0.5 / q;
    for (var i = 0u; i < N; i++) {
        triangle.grad[i] = triangle.grad[i] * slope;
    }
    return Eval(c * q, triangle.grad);
}
