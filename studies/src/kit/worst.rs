//! The largest of several figures, where NaN counts as the largest.

/// The larger of two numbers; NaN is larger than any number. For `fold(0.0, larger)`.
pub fn larger(most: f64, next: f64) -> f64 {
    if most.is_nan() || next <= most { most } else { next }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nan_stays_the_largest() {
        let worst = |figures: [f64; 3]| figures.into_iter().fold(0.0, larger);
        assert_eq!(worst([0.1, 0.3, 0.2]), 0.3);
        assert!(worst([f64::NAN, 0.1, 0.2]).is_nan() && worst([0.1, 0.2, f64::NAN]).is_nan());
    }
}
