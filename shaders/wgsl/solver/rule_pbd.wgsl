// PBD: the stiffness is a fraction of the error. The same operations as `Pbd::fraction`.
fn multiplier_fraction(c: f32, weighted_square: f32, stiffness: f32, multiplier: f32) -> vec2f {
    return vec2f(-(stiffness * c), weighted_square);
}
