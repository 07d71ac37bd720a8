// Returns `numerator / denominator`, or zero where it is undefined or overflows. The same result as
// `quotient_or_zero` of the CPU.
fn quotient_or_zero(numerator: f32, denominator: f32) -> f32 {
    let defined = denominator != 0.0;
    let quotient = numerator / select(1.0, denominator, defined);
    return select(0.0, quotient, defined && is_finite(quotient));
}
