// Contact of the two sides of a cut. The same operations as `LipContact::eval`.
struct Params {
    part: f32,
    nx: f32,
    ny: f32,
    nz: f32,
}

fn eval(x: array<vec3f, N>, p: Params) -> Eval {
    let before = 1.0 - p.part;
    let normal = vec3f(p.nx, p.ny, p.nz);
    let gap = dot(exact3((x[0] - x[2]) * before) + exact3((x[1] - x[3]) * p.part), normal);
    let overlaps = gap < 0.0;
    let acting = normal * select(0.0, 1.0, overlaps);
    let first = acting * before;
    let second = acting * p.part;
    return Eval(select(0.0, gap, overlaps), array<vec3f, N>(first, second, -first, -second));
}
