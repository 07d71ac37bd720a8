// The image of a direction in a triangle, used by the three kinds of skin strips. The same
// operations as in `strip.rs`.
fn strip_image(x: array<vec3f, N>, b1: f32, b2: f32, rise: vec3f) -> vec3f {
    return exact3((x[0] - x[2]) * b1) + exact3((x[1] - x[2]) * b2) - rise;
}

fn inverse_or_zero(x: f32) -> f32 {
    let positive = x > 0.0;
    return select(0.0, 1.0 / select(1.0, x, positive), positive);
}

fn strip_gradients(of_image: vec3f, b1: f32, b2: f32) -> array<vec3f, N> {
    return array<vec3f, N>(of_image * b1, of_image * b2, of_image * -(b1 + b2));
}

// 1/r² for the reach of a projection. The same operations as `strip::inverse_reach_squared`.
fn strip_reach(length: f32, scan_length: f32) -> f32 {
    let size = max(length, scan_length);
    return inverse_or_zero(size * size) * (1.0 / 16.0);
}
