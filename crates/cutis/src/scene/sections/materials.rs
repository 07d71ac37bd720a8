//! The section `materials`: the tissue of a vertex by HU and depth below the skin, and its moduli.

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

use super::material_presets;
use crate::Error;
use crate::scene::choice::OneOr;
use crate::scene::validate::Check;
use crate::scene::{ModelChoice, Scene, SceneFile};

/// Key of the section.
pub(crate) const MATERIALS_KEY: &str = "materials";
/// Most rows of a table. The number of a row fits one byte.
const MOST_ROWS: usize = 256;

/// Materials by HU and depth: the name of a preset, or rows.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum TissueMaterials {
    /// The name of a preset.
    Preset(String),
    /// Rows. A vertex gets the first row whose ranges hold its HU and its depth.
    Rows(Vec<TissueMaterialSection>),
}

impl<'de> Deserialize<'de> for TissueMaterials {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(match OneOr::deserialize(deserializer)? {
            OneOr::One(name) => Self::Preset(name),
            OneOr::List(rows) => Self::Rows(rows),
        })
    }
}

/// One tissue. A vertex belongs to the first row whose ranges hold its HU and its depth. A range
/// holds its first number but not its second.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TissueMaterialSection {
    /// Name of the tissue in reports and messages.
    pub name: String,
    /// Range of HU. Left out: any HU.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hu: Option<[f64; 2]>,
    /// Range of the depth below the skin that `skin.mode` finds, mm. Left out: any depth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth_mm: Option<[f64; 2]>,
    /// Young's modulus of the tissue, Pa (`xpbd`, `vbd`). The springs get four times as much with
    /// the split `kuhn6`, which gives the body this modulus along the axes of the lattice, and five
    /// times as much with `five`, which gives it this modulus in all directions.
    pub youngs_modulus_pa: f64,
    /// Bulk modulus, Pa (`xpbd`, `vbd`).
    pub bulk_modulus_pa: f64,
    /// Source of the values, for reports.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
}

impl TissueMaterialSection {
    /// Whether the row holds a vertex with this HU at this depth in mm.
    pub(crate) fn holds(&self, hu: f32, depth_mm: f32) -> bool {
        gap(self.hu, hu) == 0.0 && gap(self.depth_mm, depth_mm) == 0.0
    }

    /// Distance of an HU from the row's range; 0 inside.
    pub(crate) fn hu_gap(&self, hu: f32) -> f32 {
        gap(self.hu, hu)
    }

    /// Distance of a depth from the row's range, mm; 0 inside.
    pub(crate) fn depth_gap_mm(&self, depth_mm: f32) -> f32 {
        gap(self.depth_mm, depth_mm)
    }
}

/// Distance of a value from a half-open range; 0 only inside. The bounds are rounded as the values
/// are, so that a value computed as 0.3 lies on a bound of 0.3.
fn gap(range: Option<[f64; 2]>, value: f32) -> f32 {
    let Some([low, high]) = range.map(|range| range.map(|bound| bound as f32)) else { return 0.0 };
    if value < low {
        low - value
    } else if value >= high {
        (value - high).max(f32::MIN_POSITIVE)
    } else {
        0.0
    }
}

impl TissueMaterials {
    /// The rows of the table.
    ///
    /// # Errors
    /// [`Error::SceneKey`] for a preset that does not exist.
    pub(crate) fn rows(&self, file: SceneFile<'_>) -> Result<Vec<TissueMaterialSection>, Error> {
        match self {
            Self::Rows(rows) => Ok(rows.clone()),
            Self::Preset(name) => material_presets::rows(name).ok_or_else(|| {
                let names: Vec<&str> = material_presets::names().collect();
                let why = format!("no such preset; use {}, or a list of rows", names.join(", "));
                file.bad_key(MATERIALS_KEY, &format!("{name:?}"), &why)
            }),
        }
    }

    /// Whether a row depends on the depth below the skin.
    pub(crate) fn name_depth(&self) -> bool {
        let preset;
        let rows = match self {
            Self::Rows(rows) => rows,
            Self::Preset(name) => {
                preset = material_presets::rows(name).unwrap_or_default();
                &preset
            }
        };
        rows.iter().any(|row| row.depth_mm.is_some())
    }
}

impl Scene {
    /// The table of materials, if the model of the scene uses it.
    pub(crate) fn used_materials(&self) -> Option<&TissueMaterials> {
        self.materials.as_ref().filter(|_| self.model == ModelChoice::Pbd)
    }

    /// Checks the table of materials.
    pub(crate) fn validate_materials(&self, check: &Check<'_>) -> Result<(), Error> {
        let Some(materials) = &self.materials else { return Ok(()) };
        let rows = materials.rows(check.file)?;
        let fits = (1..=MOST_ROWS).contains(&rows.len());
        let why = format!("has {} rows; it must have 1 to {MOST_ROWS}", rows.len());
        check.require(fits, MATERIALS_KEY, "", &why)?;
        rows.iter().enumerate().try_for_each(|(n, row)| row.validate(check, n))
    }
}

impl TissueMaterialSection {
    fn validate(&self, check: &Check<'_>, number: usize) -> Result<(), Error> {
        let key = |field: &str| format!("{MATERIALS_KEY}[{number}].{field}");
        let why = "must name the tissue";
        check.require(!self.name.trim().is_empty(), &key("name"), format!("{:?}", self.name), why)?;
        let range = |field: &str, range: Option<[f64; 2]>, lowest: f64, why: &str| {
            let [low, high] = range.unwrap_or([0.0, 1.0]);
            let valid = low >= lowest && low < high && high < f64::INFINITY && low > f64::NEG_INFINITY;
            check.require(valid, &key(field), format!("{:?}", [low, high]), why)
        };
        let why = "must be two finite numbers, the first below the second";
        range("hu", self.hu, f64::NEG_INFINITY, why)?;
        let why = "must be two finite numbers, 0 or more, the first below the second";
        range("depth_mm", self.depth_mm, 0.0, why)?;
        check.positive(&key("youngs_modulus_pa"), self.youngs_modulus_pa)?;
        check.positive(&key("bulk_modulus_pa"), self.bulk_modulus_pa)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(hu: Option<[f64; 2]>, depth_mm: Option<[f64; 2]>) -> TissueMaterialSection {
        let name = "tissue".to_owned();
        TissueMaterialSection {
            name,
            hu,
            depth_mm,
            youngs_modulus_pa: 1.0,
            bulk_modulus_pa: 1.0,
            source: None,
        }
    }

    #[test]
    fn a_range_holds_its_first_number_and_not_its_second() {
        let both = row(Some([-30.0, 250.0]), Some([0.3, 2.0]));
        for (hu, depth_mm, held) in [
            (-30.0, 0.3, true),
            (249.9, 1.9, true),
            (250.0, 1.0, false),
            (-30.1, 1.0, false),
            (0.0, 2.0, false),
            (0.0, 0.2, false),
        ] {
            assert_eq!(both.holds(hu, depth_mm), held, "{hu} HU, {depth_mm} mm");
        }
        assert!(row(None, None).holds(-1e6, 1e6));
    }

    #[test]
    fn a_gap_is_the_distance_from_the_range() {
        let both = row(Some([-30.0, 250.0]), Some([0.0, 2.0]));
        assert_eq!([both.hu_gap(-50.0), both.hu_gap(0.0), both.hu_gap(260.0)], [20.0, 0.0, 10.0]);
        assert!(both.hu_gap(250.0) > 0.0 && both.depth_gap_mm(2.0) > 0.0);
        assert_eq!(both.depth_gap_mm(5.0), 3.0);
    }
}
