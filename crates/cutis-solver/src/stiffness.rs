//! Stiffness of a kind of constraint: one value for all constraints, or one per constraint.

use cutis_constraints::Scalar;

use crate::{Formulation, SolverError};

/// One value for all constraints of a kind, or one value per constraint in the caller's order.
#[derive(Clone, Debug, PartialEq)]
pub enum Values<T> {
    /// The same value for all constraints, without storage per constraint.
    Uniform(T),
    /// One value per constraint.
    Each(Vec<T>),
}

impl<T: Copy> Values<T> {
    /// Returns the value of constraint `index`.
    ///
    /// # Panics
    /// Panics if there is no such constraint.
    #[inline(always)]
    pub fn at(&self, index: usize) -> T {
        match self {
            Self::Uniform(value) => *value,
            Self::Each(values) => values[index],
        }
    }
}

impl<T: Scalar> Values<T> {
    fn to_f64(&self) -> Values<f64> {
        match self {
            Self::Uniform(value) => Values::Uniform(value.to_f64()),
            Self::Each(values) => Values::Each(values.iter().map(|value| value.to_f64()).collect()),
        }
    }
}

/// Stiffness of a kind for one formulation.
#[derive(Clone, Debug, PartialEq)]
pub enum Stiffness<T> {
    /// Share of the error removed by one projection, in `[0, 1]`; for [`Formulation::Pbd`].
    Pbd(Values<T>),
    /// Compliance `α = 1/k` of the energy `½C²/α`, 0 or more; for [`Formulation::Xpbd`].
    Compliance(Values<T>),
}

impl<T: Scalar> Stiffness<T> {
    /// Returns the same PBD stiffness for all constraints.
    pub fn pbd(stiffness: T) -> Self {
        Self::Pbd(Values::Uniform(stiffness))
    }

    /// Returns the same compliance for all constraints.
    pub fn compliance(compliance: T) -> Self {
        Self::Compliance(Values::Uniform(compliance))
    }

    /// Returns the formulation of this stiffness.
    pub fn formulation(&self) -> Formulation {
        match self {
            Self::Pbd(_) => Formulation::Pbd,
            Self::Compliance(_) => Formulation::Xpbd,
        }
    }

    /// Returns the values, independent of the formulation.
    pub fn values(&self) -> &Values<T> {
        match self {
            Self::Pbd(values) | Self::Compliance(values) => values,
        }
    }

    /// Returns the same values in double precision.
    pub fn to_f64(&self) -> Stiffness<f64> {
        match self {
            Self::Pbd(values) => Stiffness::Pbd(values.to_f64()),
            Self::Compliance(values) => Stiffness::Compliance(values.to_f64()),
        }
    }

    /// Checks the range and the number of values, then sorts values per constraint by `order`.
    pub(crate) fn validated(
        self,
        kind: &'static str,
        count: usize,
        order: &[u32],
    ) -> Result<Self, SolverError> {
        let highest = match self {
            Self::Pbd(_) => 1.0,
            Self::Compliance(_) => f64::MAX,
        };
        let (values, expected): (Values<T>, _) = match self {
            Self::Pbd(ref values) => (values.clone(), "a PBD stiffness from 0 to 1"),
            Self::Compliance(ref values) => (values.clone(), "a finite compliance, 0 or more"),
        };
        let check = |constraint, value: T| {
            let value = value.to_f64();
            let valid = (0.0..=highest).contains(&value);
            if valid { Ok(()) } else { Err(SolverError::Stiffness { kind, constraint, value, expected }) }
        };
        let values = match values {
            Values::Uniform(value) => {
                check(None, value)?;
                Values::Uniform(value)
            }
            Values::Each(values) => {
                if values.len() != count {
                    let what = "stiffness values";
                    return Err(SolverError::KindLength { kind, what, found: values.len(), expected: count });
                }
                for (constraint, &value) in values.iter().enumerate() {
                    check(Some(constraint), value)?;
                }
                Values::Each(order.iter().map(|&k| values[k as usize]).collect())
            }
        };
        Ok(match self {
            Self::Pbd(_) => Self::Pbd(values),
            Self::Compliance(_) => Self::Compliance(values),
        })
    }
}
