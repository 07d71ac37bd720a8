// XPBD: the stiffness is a compliance. The same operations as `Xpbd::fraction`.
fn multiplier_fraction(c: f32, weighted_square: f32, stiffness: f32, multiplier: f32) -> vec2f {
    let compliance = stiffness * settings.inverse_h_squared;
    return vec2f(-c - compliance * multiplier, weighted_square + compliance);
}
