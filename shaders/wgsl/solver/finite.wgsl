// Tests the bits, because arithmetic on NaN and infinity is not defined on every device.
fn is_finite(value: f32) -> bool {
    return (bitcast<u32>(value) & 0x7f800000u) != 0x7f800000u;
}
