//! Piecewise-linear tables from Hounsfield units to a tissue property.

use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::VolumeError;

/// A piecewise-linear function of HU, constant before its first and after its last point.
///
/// In TOML: a unit and points `[hu, value]`.
///
/// ```
/// use cutis_volume::Table;
/// let table = Table::from_toml("unit = 'kg/m3'\npoints = [[-1000, 1.2], [0, 1000]]")?;
/// assert_eq!(table.at(-500.0), 500.6);
/// assert_eq!(table.at(900.0), 1000.0);
/// assert!(Table::from_toml("unit = 'kg/m3'\npoints = [[0, 1], [0, 2]]").is_err());
/// # Ok::<(), cutis_volume::VolumeError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Text", into = "Text")]
pub struct Table {
    unit: String,
    points: Vec<(f32, f32)>,
}

/// What a table says about a tissue, and which presets it has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum TableKind {
    /// Opacity, 0 to 1; 0 means air. Preset `paper`: 0 up to −449 HU, 1 from 6 HU on, linear between (STC paper, Figure 1).
    Alpha,
    /// Mass density, kg/m³. Presets `schneider2000` and `water` (1000 kg/m³ everywhere).
    ///
    /// `schneider2000`: the calibration of U. Schneider, E. Pedroni, A. Lomax, *Phys. Med. Biol.* 45 (2000) 459–478,
    /// with the points at which GATE and other Monte Carlo codes tabulate it.
    Density,
    /// Stiffness as a factor without unit, to be multiplied with the material's modulus. Presets `uniform` (1 everywhere) and
    /// `paper`: HU normalized between −449 and 6, the two ends of the paper's transfer function (STC paper, §4.2, normalizes by
    /// density without printing the range).
    Stiffness,
}

impl TableKind {
    /// Names of the presets, the default first.
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
    /// From points `(hu, value)` in ascending order of HU; `unit` is the unit of the values, `1` for a bare number.
    ///
    /// # Errors
    /// [`VolumeError::Table`] if there is no point, a number is not finite, or HU do not increase strictly.
    pub fn new(unit: &str, points: &[(f32, f32)]) -> Result<Self, VolumeError> {
        let right = |n: usize| {
            points[n].0.is_finite() && points[n].1.is_finite() && (n == 0 || points[n - 1].0 < points[n].0)
        };
        match (0..points.len()).find(|&n| !right(n)) {
            None if !points.is_empty() => Ok(Self { unit: unit.into(), points: points.into() }),
            wrong => {
                let point = wrong.unwrap_or(0);
                let value = points.get(point).copied();
                Err(VolumeError::Table { unit: unit.into(), count: points.len(), point, value })
            }
        }
    }

    /// A built-in table; see [`TableKind`] for where its figures come from.
    ///
    /// # Errors
    /// [`VolumeError::Preset`] with the names there are.
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

    /// From TOML text.
    ///
    /// # Errors
    /// [`VolumeError::TableText`] for text that is no table or has unknown keys.
    pub fn from_toml(text: &str) -> Result<Self, VolumeError> {
        parse("table", text)
    }

    /// From a TOML file.
    ///
    /// # Errors
    /// [`VolumeError::Io`], and as [`Table::from_toml`] with the file's name.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, VolumeError> {
        let path = path.as_ref();
        let text = fs::read_to_string(path).map_err(|source| VolumeError::Io {
            path: path.into(),
            action: "read",
            source,
        })?;
        parse(&path.display().to_string(), &text)
    }

    /// The value at `hu`.
    pub fn at(&self, hu: f32) -> f32 {
        let next = self.points.partition_point(|point| point.0 <= hu);
        match (next.checked_sub(1).map(|last| self.points[last]), self.points.get(next)) {
            (Some((a, low)), Some(&(b, high))) => {
                // In f64: the span between two f32 can exceed f32, and rounding must not leave [low, high].
                let t = (f64::from(hu) - f64::from(a)) / (f64::from(b) - f64::from(a));
                (f64::from(low) * (1.0 - t) + f64::from(high) * t) as f32
            }
            (Some((_, value)), None) | (None, Some(&(_, value))) => value,
            (None, None) => f32::NAN,
        }
    }

    /// For an alpha table: true below the point at which it rises from 0.
    ///
    /// The foot of the ramp itself (−449 HU in the preset) is tissue. The paper leaves that open; the counts of its rule that an
    /// independent program gave on real scans hold with this reading only.
    pub fn is_air(&self, hu: f32) -> bool {
        self.points.iter().take_while(|point| point.1 == 0.0).last().is_some_and(|foot| hu < foot.0)
    }

    /// Unit of the values.
    pub fn unit(&self) -> &str {
        &self.unit
    }

    /// The points `(hu, value)`, in ascending order of HU.
    pub fn points(&self) -> &[(f32, f32)] {
        &self.points
    }
}

/// The TOML form.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Text {
    unit: String,
    points: Vec<(f32, f32)>,
}

impl TryFrom<Text> for Table {
    type Error = VolumeError;

    fn try_from(text: Text) -> Result<Self, VolumeError> {
        Self::new(&text.unit, &text.points)
    }
}

impl From<Table> for Text {
    fn from(table: Table) -> Self {
        Self { unit: table.unit, points: table.points }
    }
}

fn parse(origin: &str, text: &str) -> Result<Table, VolumeError> {
    toml::from_str(text)
        .map_err(|error| VolumeError::TableText { origin: origin.into(), message: error.to_string() })
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
    fn wrong_tables_are_refused() {
        for points in [&[][..], &[(0.0, f32::NAN)], &[(f32::INFINITY, 0.0)], &[(1.0, 0.0), (1.0, 2.0)]] {
            assert!(matches!(Table::new("1", points), Err(VolumeError::Table { .. })), "{points:?}");
        }
        for text in ["", "unit = '1'", "unit = '1'\npoints = []", "unit = '1'\npoints = [[0, 1]]\ncolor = 3"]
        {
            assert!(matches!(Table::from_toml(text), Err(VolumeError::TableText { .. })), "{text:?}");
        }
        assert!(Table::from_toml("unit = '1'\npoints = [[0, 1]]").is_ok());
        let error = Table::read("no/such/table.toml").unwrap_err();
        assert!(error.to_string().contains("no/such/table.toml"), "{error}");
    }

    #[test]
    fn toml_round_trip() {
        let table = Table::preset(TableKind::Density, "schneider2000").unwrap();
        let text = toml::to_string(&table).unwrap();
        assert_eq!(Table::from_toml(&text).unwrap(), table);
    }

    proptest! {
        #[test]
        fn rising_points_give_a_rising_function_through_them(
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
            // Negative control: a falling last point breaks it.
            let mut fallen = points.clone();
            fallen.push((9000.0, points[points.len() - 1].1 - 1.0));
            let fallen = Table::new("1", &fallen).unwrap();
            prop_assert!(fallen.at(9000.0) < fallen.at(fallen.points()[points.len() - 1].0));
        }
    }
}
