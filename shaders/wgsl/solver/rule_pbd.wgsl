// PBD: the stiffness is a share of the error. The twin of `Pbd::multiplier`.
fn multiplier_change(c: f32, weighted_square: f32, stiffness: f32, multiplier: f32) -> f32 {
    return quotient_or_zero(-(stiffness * c), weighted_square);
}
