// XPBD: the stiffness is a compliance. The same operations as `Xpbd::multiplier`.
fn multiplier_change(c: f32, weighted_square: f32, stiffness: f32, multiplier: f32) -> f32 {
    let compliance = stiffness * settings.inverse_h_squared;
    return quotient_or_zero(-c - compliance * multiplier, weighted_square + compliance);
}
