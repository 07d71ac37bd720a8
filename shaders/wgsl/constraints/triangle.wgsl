// Area of a triangle and its gradient, used by both forms of skin tension. The same operations as
// `triangle::area_and_gradient`.
struct Area {
    area: f32,
    grad: array<vec3f, N>,
}

// (8 · machine epsilon)² = 2⁻⁴⁰. Below this value the normal of a triangle is rounding noise.
const NOISE_SQUARED: f32 = 1.0 / 1099511627776.0;

fn area_and_gradient(x: array<vec3f, N>) -> Area {
    let e2 = x[1] - x[0];
    let e3 = x[2] - x[0];
    let n = cross(e2, e3);
    let n_squared = dot(n, n);
    let n_length = sqrt(n_squared);
    let defined = n_squared > (NOISE_SQUARED * dot(e2, e2)) * dot(e3, e3);
    let half_normal = n * select(0.0, 0.5 / select(1.0, n_length, defined), defined);
    let grad2 = cross(e3, half_normal);
    let grad3 = cross(half_normal, e2);
    return Area(n_length * 0.5, array<vec3f, N>(-(grad2 + grad3), grad2, grad3));
}

// The relative stretch of the area, max(0, c)/rest_area. It is 0 if the rest area is 0.
fn stretch(c: f32, rest_area: f32) -> f32 {
    let stretched = c > 0.0 && rest_area > 0.0;
    return select(0.0, c / select(1.0, rest_area, stretched), stretched);
}

// 1/r² for the largest distance r of a projection along the gradient. The same operations as
// `triangle::inverse_reach_squared`.
fn inverse_reach_squared_of(x: array<vec3f, N>, rest_area: f32) -> f32 {
    let e2 = x[1] - x[0];
    let e3 = x[2] - x[0];
    let size_squared = max(max(dot(e2, e2), dot(e3, e3)), rest_area);
    let has_size = size_squared > 0.0;
    return select(0.0, (1.0 / 16.0) / select(1.0, size_squared, has_size), has_size);
}
