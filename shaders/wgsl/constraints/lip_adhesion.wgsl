// Adhesion of the two sides of a cut. The same operations as `LipAdhesion::eval`.
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
    let first = normal * before;
    let second = normal * p.part;
    return Eval(gap, array<vec3f, N>(first, second, -first, -second));
}
