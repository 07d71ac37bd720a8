// Volume: a tetrahedron keeps its signed volume. The same operations as `Volume::eval`.
struct Params {
    rest_volume: f32,
}

fn eval(x: array<vec3f, N>, p: Params) -> Eval {
    let a = x[1] - x[0];
    let b = x[2] - x[0];
    let c = x[3] - x[0];
    let edge_squared = max(max(dot(a, a), dot(b, b)), dot(c, c));
    let size_squared = max(edge_squared, sqrt(abs(p.rest_volume) * sqrt(edge_squared)));
    let has_size = size_squared > 0.0;
    inverse_reach_squared = select(0.0, (1.0 / 16.0) / select(1.0, size_squared, has_size), has_size);
    let sixth = 1.0 / 6.0;
    let grad2 = exact3(cross(b, c) * sixth);
    let grad3 = exact3(cross(c, a) * sixth);
    let grad4 = exact3(cross(a, b) * sixth);
    let grad1 = -((grad2 + grad3) + grad4);
    return Eval(dot(a, grad2) - p.rest_volume, array<vec3f, N>(grad1, grad2, grad3, grad4));
}
