// Skin tension, paper form. The same operations as `SkinTensionPaper::eval`.
struct Params {
    rest_area: f32,
    amplification: f32,
    max_amplification: f32,
}

fn eval(x: array<vec3f, N>, p: Params) -> Eval {
    let most_squared = p.max_amplification * p.max_amplification;
    inverse_reach_squared = inverse_reach_squared_of(x, p.rest_area) / max(most_squared, 1.0);
    let triangle = area_and_gradient(x);
    let c = triangle.area - p.rest_area;
    let amplified = 1.0 + p.amplification * stretch(c, p.rest_area);
    let clamped = select(p.max_amplification, amplified, amplified < p.max_amplification);
    return Eval(c * clamped, triangle.grad);
}
