//! Fixed-point coordinates: steps of the grid with 16 binary places.

/// Units of a coordinate in one step of the grid.
pub const UNITS_PER_STEP: i32 = 1 << 16;

/// Most elements along an axis. With [`FARTHEST`] it keeps every coordinate within ±2²⁹ units, and differences within 32 bits.
pub(crate) const MOST_ELEMENTS: usize = 4096;
/// Farthest that an element can be told to go, in units.
pub(crate) const FARTHEST: i32 = 1 << 28;

/// Farthest that an element can be told to go, in steps from the first element along each axis.
pub const FARTHEST_STEPS: f64 = (FARTHEST / UNITS_PER_STEP) as f64;

/// Farthest that an element can come by following others, in units.
pub(crate) const FARTHEST_MOVED: u32 = 1 << 29;

/// The nearest coordinate in units; none if it is not finite or too far away.
pub(crate) fn from_steps(steps: f64) -> Option<i32> {
    let units = (steps * f64::from(UNITS_PER_STEP)).round();
    (units.abs() <= f64::from(FARTHEST)).then_some(units as i32)
}

/// A coordinate in steps; exact.
pub(crate) fn to_steps(units: i32) -> f64 {
    f64::from(units) / f64::from(UNITS_PER_STEP)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_rounded_to_the_nearest_unit_once() {
        for units in [0, 1, -1, 12_345, FARTHEST, -FARTHEST] {
            assert_eq!(from_steps(to_steps(units)), Some(units));
        }
        for (beyond, units) in [(0.4, 0), (0.6, 1), (-0.4, 0), (-0.6, -1)] {
            assert_eq!(from_steps(1.0 + beyond / f64::from(UNITS_PER_STEP)), Some(UNITS_PER_STEP + units));
        }
        assert_eq!(
            [-1.0, 1.0].map(|side| from_steps(side * FARTHEST_STEPS)),
            [Some(-FARTHEST), Some(FARTHEST)]
        );
        for wrong in [f64::NAN, f64::INFINITY, 4096.1, -1e9] {
            assert_eq!(from_steps(wrong), None);
        }
    }
}
