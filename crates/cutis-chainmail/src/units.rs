//! Fixed-point coordinates: steps of the grid with 16 binary places.

/// Number of units in one step of the grid.
pub const UNITS_PER_STEP: i32 = 1 << 16;

/// Largest number of elements along an axis. Together with [`FARTHEST`] it keeps every coordinate
/// within ±2²⁹ units, and differences within 32 bits.
pub(crate) const MOST_ELEMENTS: usize = 4096;
/// Largest coordinate of a target in units.
pub(crate) const FARTHEST: i32 = 1 << 28;

/// Largest coordinate of a target in steps, measured from the first element along each axis.
pub const FARTHEST_STEPS: f64 = (FARTHEST / UNITS_PER_STEP) as f64;

/// Largest coordinate of any element in units.
pub(crate) const FARTHEST_MOVED: u32 = 1 << 29;

/// The nearest coordinate in units. `None` if the value is not finite or too large.
pub(crate) fn from_steps(steps: f64) -> Option<i32> {
    let units = (steps * f64::from(UNITS_PER_STEP)).round();
    (units.abs() <= f64::from(FARTHEST)).then_some(units as i32)
}

/// A coordinate in steps, without rounding.
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
