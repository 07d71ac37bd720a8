// `numerator / denominator`, or zero where that is undefined or overflows. The twin of `quotient_or_zero`.
fn quotient_or_zero(numerator: f32, denominator: f32) -> f32 {
    let defined = denominator != 0.0;
    let quotient = numerator / select(1.0, denominator, defined);
    return select(0.0, quotient, defined && is_finite(quotient));
}
