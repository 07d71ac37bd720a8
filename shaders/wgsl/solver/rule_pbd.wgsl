// PBD: the stiffness is a fraction of the error. The same operations as `Pbd::multiplier`.
fn multiplier_change(c: f32, weighted_square: f32, stiffness: f32, multiplier: f32) -> f32 {
    return quotient_or_zero(-(stiffness * c), weighted_square);
}
