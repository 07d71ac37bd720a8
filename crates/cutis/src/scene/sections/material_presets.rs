//! The presets of the section `materials`, with the sources of their values.
//!
//! Each value is one of many that were measured. Tissues differ between people, sites and methods
//! by factors of 2 to 10, so a value is a parameter with a range. The bulk modulus is ten times
//! Young's modulus, which makes Poisson's ratio about 0.48. True tissue is nearly incompressible,
//! with a bulk modulus near the 2.2 GPa of water.

use super::TissueMaterialSection;

/// A row of a preset.
#[derive(Clone, Copy)]
struct Row {
    name: &'static str,
    hu: Option<[f64; 2]>,
    depth_mm: Option<[f64; 2]>,
    youngs_modulus_pa: f64,
    source: &'static str,
}

/// Bulk modulus over Young's modulus in all presets.
const BULK: f64 = 10.0;
/// HU of lean tissue, from fat to bone. Muscle ends at 150 HU (Aubrey 2014). The range goes on to
/// the HU at which the template fixes bone, so that vessels with contrast agent are not bone.
const LEAN_HU: [f64; 2] = [-30.0, 250.0];
/// HU of fat, and of everything between fat and air.
const FAT_HU: [f64; 2] = [-32768.0, -30.0];

/// Skin as deep as in a part of the body. Its stiffness along the surface belongs to the skin
/// tension, so the row holds the stiffness across the skin, which is that of soft tissue.
const fn skin(depth_mm: f64, source: &'static str) -> Row {
    Row { name: "skin", hu: None, depth_mm: Some([0.0, depth_mm]), youngs_modulus_pa: 6.0e3, source }
}

const FAT: Row = Row {
    name: "fat",
    hu: Some(FAT_HU),
    depth_mm: None,
    youngs_modulus_pa: 3.25e3,
    source: "3.25 kPa: excised breast fat at small strain (Samani 2007); about 2.3 kPa in the living \
             buttock, from a shear modulus of 0.75 kPa (Hatt 2023); below -30 HU (Aubrey 2014)",
};

const LEAN: Row = Row {
    name: "muscle and organs",
    hu: Some(LEAN_HU),
    depth_mm: None,
    youngs_modulus_pa: 8.0e3,
    source: "8 kPa, between muscle, 10.4 to 11.1 kPa (Arda 2011), and organs, 2.9 to 5.5 kPa (Arda 2011, \
             Roulot 2008)",
};

const MUSCLE: Row = Row {
    name: "muscle",
    hu: Some(LEAN_HU),
    depth_mm: None,
    youngs_modulus_pa: 10.5e3,
    source: "relaxed: masseter 10.4 ± 3.7 kPa, gastrocnemius 11.1 ± 4.1 kPa (Arda 2011); about 3 kPa in \
             the buttock, from a shear modulus of 1 kPa (Hatt 2023)",
};

const ORGANS: Row = Row {
    name: "organs",
    hu: Some(LEAN_HU),
    depth_mm: None,
    youngs_modulus_pa: 5.0e3,
    source: "liver 5.5 ± 1.6 kPa (Roulot 2008); kidney cortex 5.0 ± 2.9, pancreas 4.8 ± 3.0, spleen \
             2.9 ± 1.8 kPa (Arda 2011)",
};

/// The rest: everything at 250 HU or more.
const BONE: Row = Row {
    name: "bone",
    hu: None,
    depth_mm: None,
    youngs_modulus_pa: 3.25e6,
    source: "a thousand times fat; true bone has 10.4 GPa (trabecular) to 18.6 GPa (cortical; Rho 1993), \
             which is rigid in comparison",
};

const PRESETS: [(&str, &[Row]); 4] = [
    (
        "layered",
        &[
            skin(
                2.0,
                "4.5 to 8 kPa by indentation of the forearm (Pailler-Mattei 2008); 129 kPa along the skin \
                 (suction, Diridollou 2000) belongs to the skin tension; 1.55 to 2.54 mm thick (Laurent \
                 2007)",
            ),
            FAT,
            LEAN,
            BONE,
        ],
    ),
    (
        "trunk",
        &[
            skin(
                2.2,
                "4.5 to 8 kPa by indentation of the forearm (Pailler-Mattei 2008); thickness 1.91 mm at the \
                 waist, 2.54 mm at the shoulder blade (Laurent 2007)",
            ),
            FAT,
            Row { depth_mm: Some([0.0, 40.0]), ..MUSCLE },
            ORGANS,
            BONE,
        ],
    ),
    (
        "limb",
        &[
            skin(
                1.6,
                "4.5 to 8 kPa by indentation of the forearm (Pailler-Mattei 2008); thickness 1.55 mm at the \
                 thigh, 2.02 mm at the deltoid (Laurent 2007)",
            ),
            FAT,
            MUSCLE,
            BONE,
        ],
    ),
    (
        "head",
        &[
            skin(
                1.5,
                "4.5 to 8 kPa by indentation of the forearm (Pailler-Mattei 2008); thickness of the dermis \
                 0.76 mm (eyelid) to 1.97 mm (nose; Chopra 2015)",
            ),
            FAT,
            LEAN,
            BONE,
        ],
    ),
];

/// Names of the presets. The general one comes first.
pub(super) fn names() -> impl Iterator<Item = &'static str> {
    PRESETS.iter().map(|(name, _)| *name)
}

/// The rows of a preset; none if no preset has this name.
pub(super) fn rows(name: &str) -> Option<Vec<TissueMaterialSection>> {
    let (_, rows) = PRESETS.iter().find(|(preset, _)| *preset == name)?;
    Some(rows.iter().map(TissueMaterialSection::from).collect())
}

impl From<&Row> for TissueMaterialSection {
    fn from(row: &Row) -> Self {
        let Row { name, hu, depth_mm, youngs_modulus_pa, source } = *row;
        Self {
            name: name.into(),
            hu,
            depth_mm,
            youngs_modulus_pa,
            bulk_modulus_pa: BULK * youngs_modulus_pa,
            source: Some(source.into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_preset_holds_all_tissue_with_a_source_and_a_contrast_of_1000_at_most() {
        for name in names() {
            let rows = rows(name).unwrap();
            for hu in [-32768.0, -449.0, -100.0, -30.0, 50.0, 249.0, 250.0, 30000.0] {
                for depth_mm in [0.0, 1.9, 39.0, 300.0] {
                    assert!(rows.iter().any(|row| row.holds(hu, depth_mm)), "{name}: {hu}, {depth_mm}");
                }
            }
            let moduli = rows.iter().map(|row| row.youngs_modulus_pa);
            let [softest, stiffest] =
                moduli.fold([f64::INFINITY, 0.0], |[low, high], e| [e.min(low), e.max(high)]);
            assert!(stiffest <= 1000.0 * softest && softest > 1e3, "{name}: {softest} to {stiffest}");
            // Each source names a year.
            let dated = |row: &TissueMaterialSection| {
                let source = row.source.as_deref().unwrap_or_default();
                source.split([' ', ')', ';', ',']).any(|word| word.parse().is_ok_and(|n: u32| n > 1900))
            };
            assert!(rows.iter().all(dated), "{name}");
            // Control: without its last row a preset does not hold bone.
            assert!(!rows[..rows.len() - 1].iter().any(|row| row.holds(300.0, 300.0)), "{name}");
        }
        assert!(rows("unheard of").is_none());
    }
}
