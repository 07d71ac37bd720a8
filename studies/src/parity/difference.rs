//! The difference of two sequences of numbers, and the largest allowed difference of an adapter.

use cutis_gpu::{Adapter, AdapterKind};

use super::comparison::{Figures, Measured};

/// Largest difference on hardware after a few frames, as a share of the extent of the body.
/// Hardware may fuse a product with a sum.
pub const TOLERANCE: f64 = 1e-6;

/// Requirement for an adapter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Policy {
    /// Every number equals the number of the CPU.
    Exact,
    /// Numbers differ by at most this share of their extent.
    Within(f64),
}

impl Policy {
    /// Software adapters have to be exact; hardware has [`TOLERANCE`].
    pub fn of(adapter: &Adapter) -> Self {
        match adapter.kind {
            AdapterKind::Software => Self::Exact,
            _ => Self::Within(TOLERANCE),
        }
    }

    /// Description of the policy.
    pub fn describe(self) -> String {
        match self {
            Self::Exact => "every number equal".into(),
            Self::Within(share) => format!("within {share:.0e} of the extent"),
        }
    }
}

/// The difference between the results of a device and of the CPU.
#[derive(Clone, Copy, Debug, Default)]
pub struct Difference {
    compared: u64,
    differing: u64,
    /// Largest difference over the extent; infinite for NaN.
    worst: f64,
}

impl Difference {
    /// Adds two sequences of numbers with their extent. The difference of a missing number is
    /// infinite.
    pub fn add(
        mut self,
        found: impl IntoIterator<Item = f32>,
        expected: impl IntoIterator<Item = f32>,
        extent: f64,
    ) -> Self {
        let (mut found, mut expected) = (found.into_iter(), expected.into_iter());
        loop {
            let apart = match (found.next(), expected.next()) {
                (None, None) => return self,
                (Some(a), Some(b)) if a == b => 0.0,
                (Some(a), Some(b)) => (f64::from(a) - f64::from(b)).abs() / extent,
                _ => f64::NAN,
            };
            self.compared += 1;
            self.differing += u64::from(apart != 0.0);
            // A comparison with NaN is false.
            self.worst = if apart <= self.worst {
                self.worst
            } else if apart.is_nan() {
                f64::INFINITY
            } else {
                apart
            };
        }
    }

    /// Judges the difference by a policy.
    pub fn judged(self, policy: Policy) -> Measured {
        let Self { compared, differing, worst } = self;
        let (agrees, tolerance) = match policy {
            Policy::Exact => (differing == 0, 0.0),
            Policy::Within(share) => (worst <= share, share),
        };
        let figures = Figures { compared, differing, worst, tolerance, of: "extent" };
        Measured::new(agrees, figures)
    }
}

/// The first three of every four numbers.
pub fn triples(rows: &[[f32; 4]]) -> impl Iterator<Item = f32> {
    rows.iter().flat_map(|&[x, y, z, _]| [x, y, z])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(found: &[f32], expected: &[f32], policy: Policy) -> Measured {
        let of = |numbers: &[f32]| numbers.to_vec();
        Difference::default().add(of(found), of(expected), 2.0).judged(policy)
    }

    #[test]
    fn software_must_be_equal_and_hardware_near() {
        let near = [1.0, 1.0 + f32::EPSILON];
        assert!(measured(&near, &near, Policy::Exact).agrees);
        assert!(!measured(&near, &[1.0, 1.0], Policy::Exact).agrees);
        let within = measured(&near, &[1.0, 1.0], Policy::Within(TOLERANCE));
        assert!(within.agrees);
        assert_eq!((within.figures.compared, within.figures.differing), (2, 1));
        assert!(!measured(&[1.0, 1.001], &[1.0, 1.0], Policy::Within(TOLERANCE)).agrees);
    }

    #[test]
    fn nan_and_missing_numbers_never_agree() {
        for policy in [Policy::Exact, Policy::Within(TOLERANCE)] {
            assert!(!measured(&[f32::NAN], &[f32::NAN], policy).agrees);
            assert!(!measured(&[f32::NAN, 1.0], &[1.0, 1.0], policy).agrees);
            assert!(!measured(&[1.0], &[1.0, 2.0], policy).agrees);
            assert!(!measured(&[], &[], policy).agrees);
        }
    }
}
