// Distance: an edge keeps its length. The same operations as `Distance::eval`.
struct Params {
    rest_length: f32,
}

fn eval(x: array<vec3f, N>, p: Params) -> Eval {
    let d = x[0] - x[1];
    let length = sqrt(dot(d, d));
    let apart = length > 0.0;
    let inverse = select(0.0, 1.0 / select(1.0, length, apart), apart);
    let direction = d * inverse;
    unit_gradients = true;
    along = array<vec3f, N>(d, -d);
    along_length = length;
    return Eval(length - p.rest_length, array<vec3f, N>(direction, -direction));
}
