// Thread between points of two triangles. The same operations as `Thread::eval`.
struct Params {
    a: f32,
    b: f32,
    c: f32,
    d: f32,
    length: f32,
}

fn eval(x: array<vec3f, N>, p: Params) -> Eval {
    let first = exact3((x[1] - x[0]) * p.a) + exact3((x[2] - x[0]) * p.b);
    let second = exact3((x[4] - x[3]) * p.c) + exact3((x[5] - x[3]) * p.d);
    let span = (x[0] - x[3]) + (first - second);
    let distance = sqrt(dot(span, span));
    let excess = distance - p.length;
    let taut = excess > 0.0;
    let apart = distance > 0.0;
    let inverse = select(0.0, 1.0 / select(1.0, distance, apart), apart && taut);
    let direction = span * inverse;
    let grad = array<vec3f, N>(
        direction * ((1.0 - p.a) - p.b),
        direction * p.a,
        direction * p.b,
        direction * ((p.c - 1.0) + p.d),
        direction * -p.c,
        direction * -p.d,
    );
    return Eval(select(0.0, excess, taut), grad);
}
