// Fiber stretch: a tetrahedron keeps its length along a fiber. The twin of `FiberStretch::eval`.
struct Params {
    b1: f32,
    b2: f32,
    b3: f32,
    rest: f32,
}

fn eval(x: array<vec3f, N>, p: Params) -> Eval {
    let f = ((x[1] - x[0]) * p.b1 + (x[2] - x[0]) * p.b2) + (x[3] - x[0]) * p.b3;
    let length = sqrt(dot(f, f));
    let defined = length > 0.0;
    let direction = f * select(0.0, 1.0 / select(1.0, length, defined), defined);
    return Eval(length - p.rest, array<vec3f, N>(
        direction * -((p.b1 + p.b2) + p.b3), direction * p.b1, direction * p.b2, direction * p.b3,
    ));
}
