//! Piecewise-linear tables from Hounsfield units to a tissue property.

use crate::VolumeError;

/// A piecewise-linear function of HU. It is constant below its first and above its last point.
///
/// ```
/// use cutis_volume::Table;
/// let table = Table::new("kg/m3", &[(-1000.0, 1.2), (0.0, 1000.0)])?;
/// assert_eq!(table.at(-500.0), 500.6);
/// assert_eq!(table.at(900.0), 1000.0);
/// assert!(Table::new("kg/m3", &[(0.0, 1.0), (0.0, 2.0)]).is_err());
/// # Ok::<(), cutis_volume::VolumeError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    unit: String,
    points: Vec<(f32, f32)>,
}

/// The property of tissue that a table gives, with its presets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum TableKind {
    /// Opacity from 0 to 1, where 0 means air. Preset `paper`: 0 up to −449 HU, 1 from 6 HU, linear
    /// between (STC paper, Figure 1).
    Alpha,
    /// Mass density in kg/m³. Presets `schneider2000` and `water` (1000 kg/m³ everywhere).
    ///
    /// `schneider2000` is the calibration of U. Schneider, E. Pedroni and A. Lomax, *Phys. Med.
    /// Biol.* 45 (2000) 459–478, at the points where GATE and other Monte Carlo codes tabulate it.
    Density,
    /// Factor of the material's modulus, without unit. Presets `uniform` (1 everywhere) and
    /// `paper`.
    ///
    /// `paper` rises from 0 at −449 HU to 1 at 6 HU, the two ends of the paper's transfer function.
    /// The STC paper (§4.2) normalizes by density but does not print the range.
    Stiffness,
}

impl TableKind {
    /// Names of the presets. The default comes first.
    pub fn presets(self) -> &'static [&'static str] {
        match self {
            Self::Alpha => &["paper"],
            Self::Density => &["schneider2000", "water"],
            Self::Stiffness => &["uniform", "paper"],
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Alpha => "alpha",
            Self::Density => "density",
            Self::Stiffness => "stiffness",
        }
    }
}

const PAPER_RAMP: &[(f32, f32)] = &[(-449.0, 0.0), (6.0, 1.0)];
const SCHNEIDER2000: &[(f32, f32)] = &[
    (-1000.0, 1.21),
    (-98.0, 930.0),
    (-97.0, 930.486),
    (14.0, 1030.0),
    (23.0, 1031.0),
    (100.0, 1119.9),
    (101.0, 1076.2),
    (1600.0, 1964.2),
    (3000.0, 2800.0),
];

impl Table {
    /// Creates a table from points `(hu, value)` in ascending order of HU. `unit` is the unit of
    /// the values, `1` for a plain number.
    ///
    /// # Errors
    /// [`VolumeError::Table`] if there is no point, a number is not finite, or the HU do not
    /// increase strictly.
    pub fn new(unit: &str, points: &[(f32, f32)]) -> Result<Self, VolumeError> {
        let valid = |n: usize| {
            points[n].0.is_finite() && points[n].1.is_finite() && (n == 0 || points[n - 1].0 < points[n].0)
        };
        match (0..points.len()).find(|&n| !valid(n)) {
            None if !points.is_empty() => Ok(Self { unit: unit.into(), points: points.into() }),
            wrong => {
                let point = wrong.unwrap_or(0);
                let value = points.get(point).copied();
                Err(VolumeError::Table { unit: unit.into(), count: points.len(), point, value })
            }
        }
    }

    /// Returns a built-in table. [`TableKind`] lists the presets and their sources.
    ///
    /// # Errors
    /// [`VolumeError::Preset`] if no preset has this name.
    pub fn preset(kind: TableKind, name: &str) -> Result<Self, VolumeError> {
        match (kind, name) {
            (TableKind::Alpha | TableKind::Stiffness, "paper") => Self::new("1", PAPER_RAMP),
            (TableKind::Density, "schneider2000") => Self::new("kg/m3", SCHNEIDER2000),
            (TableKind::Density, "water") => Self::new("kg/m3", &[(0.0, 1000.0)]),
            (TableKind::Stiffness, "uniform") => Self::new("1", &[(0.0, 1.0)]),
            _ => Err(VolumeError::Preset {
                kind: kind.name(),
                name: name.into(),
                expected: kind.presets().join(" or "),
            }),
        }
    }

    /// The value at `hu`.
    pub fn at(&self, hu: f32) -> f32 {
        let next = self.points.partition_point(|point| point.0 <= hu);
        match (next.checked_sub(1).map(|last| self.points[last]), self.points.get(next)) {
            (Some((a, low)), Some(&(b, high))) => {
                // In f64, because the difference of two f32 can overflow f32 and rounding must stay
                // within [low, high].
                let t = (f64::from(hu) - f64::from(a)) / (f64::from(b) - f64::from(a));
                (f64::from(low) * (1.0 - t) + f64::from(high) * t) as f32
            }
            (Some((_, value)), None) | (None, Some(&(_, value))) => value,
            (None, None) => f32::NAN,
        }
    }

    /// True if `hu` is air according to an alpha table: below the last point with the value 0.
    ///
    /// That point itself (−449 HU in the preset) is tissue. The paper does not specify it. Only
    /// this choice reproduces the triangle counts of an independent program on real scans.
    pub fn is_air(&self, hu: f32) -> bool {
        self.points.iter().take_while(|point| point.1 == 0.0).last().is_some_and(|zero| hu < zero.0)
    }

    /// The unit of the values.
    pub fn unit(&self) -> &str {
        &self.unit
    }

    /// The points `(hu, value)`, in ascending order of HU.
    pub fn points(&self) -> &[(f32, f32)] {
        &self.points
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn presets_have_the_published_values() {
        let alpha = Table::preset(TableKind::Alpha, "paper").unwrap();
        assert!(alpha.is_air(-449.1) && alpha.is_air(-3024.0) && !alpha.is_air(-449.0));
        assert!(!Table::new("1", &[(0.0, 1.0)]).unwrap().is_air(-3024.0));
        assert_eq!([alpha.at(6.0), alpha.at(3000.0), alpha.at(-221.5)], [1.0, 1.0, 0.5]);
        let density = Table::preset(TableKind::Density, "schneider2000").unwrap();
        assert_eq!(
            [density.at(-1000.0), density.at(1600.0), density.unit().len() as f32],
            [1.21, 1964.2, 5.0]
        );
        assert!((density.at(0.0) - 1018.0).abs() < 1.0, "soft tissue");
        for kind in [TableKind::Alpha, TableKind::Density, TableKind::Stiffness] {
            for name in kind.presets() {
                assert!(Table::preset(kind, name).is_ok(), "{name}");
            }
            let error = Table::preset(kind, "schneider").unwrap_err();
            assert!(error.to_string().contains(kind.presets()[0]), "{error}");
        }
    }

    #[test]
    fn invalid_tables_are_refused() {
        for points in [&[][..], &[(0.0, f32::NAN)], &[(f32::INFINITY, 0.0)], &[(1.0, 0.0), (1.0, 2.0)]] {
            assert!(matches!(Table::new("1", points), Err(VolumeError::Table { .. })), "{points:?}");
        }
    }

    proptest! {
        #[test]
        fn increasing_points_give_an_increasing_function_through_them(
            steps in prop::collection::vec((0.01f32..500.0, 0.0f32..100.0), 1..12),
            at in prop::collection::vec(-2000.0f32..8000.0, 2..20),
        ) {
            let mut point = (-1000.0, 0.0);
            let points: Vec<(f32, f32)> = steps
                .iter()
                .map(|(hu, value)| {
                    point = (point.0 + hu, point.1 + value);
                    point
                })
                .collect();
            let table = Table::new("1", &points).unwrap();
            for (hu, value) in &points {
                prop_assert_eq!(table.at(*hu), *value);
            }
            let mut at = at;
            at.sort_by(f32::total_cmp);
            prop_assert!(at.windows(2).all(|pair| table.at(pair[0]) <= table.at(pair[1])));
            // Negative control: a decreasing last point breaks it.
            let mut decreasing = points.clone();
            decreasing.push((9000.0, points[points.len() - 1].1 - 1.0));
            let decreasing = Table::new("1", &decreasing).unwrap();
            prop_assert!(decreasing.at(9000.0) < decreasing.at(decreasing.points()[points.len() - 1].0));
        }
    }
}
