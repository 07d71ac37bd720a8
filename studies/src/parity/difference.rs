//! How far two rows of numbers are apart, and whether that is allowed on an adapter.

use cutis_gpu::{Adapter, AdapterKind};

use super::comparison::{Figures, Measured};

/// What hardware may differ by after a few frames, as a share of the body's extent: it may fuse a product with a sum.
pub const TOLERANCE: f64 = 1e-6;

/// What an adapter is held to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Policy {
    /// Every number is that of the CPU.
    Exact,
    /// Numbers differ by at most this, over their extent.
    Within(f64),
}

impl Policy {
    /// Software rounds as the CPU does; hardware has [`TOLERANCE`].
    pub fn of(adapter: &Adapter) -> Self {
        match adapter.kind {
            AdapterKind::Software => Self::Exact,
            _ => Self::Within(TOLERANCE),
        }
    }

    /// The policy in words.
    pub fn describe(self) -> String {
        match self {
            Self::Exact => "every number equal".into(),
            Self::Within(share) => format!("within {share:.0e} of the extent"),
        }
    }
}

/// The difference of what a device found from what the CPU did.
#[derive(Clone, Copy, Debug, Default)]
pub struct Difference {
    compared: u64,
    differing: u64,
    /// Largest difference over the extent; infinite for a number that is none.
    worst: f64,
}

impl Difference {
    /// Adds numbers whose differences are compared with `extent`. Numbers without a partner differ infinitely.
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
            // NaN is on neither side of any number.
            self.worst = if apart <= self.worst {
                self.worst
            } else if apart.is_nan() {
                f64::INFINITY
            } else {
                apart
            };
        }
    }

    /// Whether an adapter may differ so far.
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

/// The numbers of rows of four, without the fourth.
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
    fn software_has_to_be_equal_and_hardware_near() {
        let near = [1.0, 1.0 + f32::EPSILON];
        assert!(measured(&near, &near, Policy::Exact).agrees);
        assert!(!measured(&near, &[1.0, 1.0], Policy::Exact).agrees);
        let within = measured(&near, &[1.0, 1.0], Policy::Within(TOLERANCE));
        assert!(within.agrees);
        assert_eq!((within.figures.compared, within.figures.differing), (2, 1));
        assert!(!measured(&[1.0, 1.001], &[1.0, 1.0], Policy::Within(TOLERANCE)).agrees);
    }

    #[test]
    fn what_is_no_number_missing_or_not_there_at_all_never_agrees() {
        for policy in [Policy::Exact, Policy::Within(TOLERANCE)] {
            assert!(!measured(&[f32::NAN], &[f32::NAN], policy).agrees);
            assert!(!measured(&[f32::NAN, 1.0], &[1.0, 1.0], policy).agrees);
            assert!(!measured(&[1.0], &[1.0, 2.0], policy).agrees);
            assert!(!measured(&[], &[], policy).agrees);
        }
    }
}
