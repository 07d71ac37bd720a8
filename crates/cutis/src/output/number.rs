//! Numbers as people read them.

/// A number with a fixed count of decimals. A number that rounds to zero has no sign: rounding
/// alone leaves values such as −1e-7 mm, which would read "-0.00".
#[must_use]
pub fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(size) if size.bytes().all(|digit| matches!(digit, b'0' | b'.')) => size.to_owned(),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::fixed;

    #[test]
    fn zero_has_no_sign_and_other_numbers_keep_theirs() {
        assert_eq!([-1.5e-7, -0.0, 0.0, -0.0049].map(|value| fixed(value, 2)), ["0.00"; 4]);
        assert_eq!([-0.0051, -12.0, 3.456].map(|value| fixed(value, 2)), ["-0.01", "-12.00", "3.46"]);
        assert_eq!([fixed(-0.4, 0), fixed(-0.6, 0), fixed(f64::NAN, 1)], ["0", "-1", "NaN"]);
    }
}
