//! Presets of skin tension by the part of the body.
//!
//! Tension and modulus of living skin vary by a factor of several between people, places and
//! postures, and no method to measure them in a patient is widely accepted (arXiv 2506.05118,
//! 2025). A preset is a start in the middle of a range.

use super::membrane::MembraneDirections;

/// Tension and modulus of the skin of one part of the body, N/m.
pub(crate) struct MembranePreset {
    pub(crate) name: &'static str,
    /// Tension along and across the lines, with the range that sources give for the larger one.
    pub(crate) tension: [f64; 2],
    pub(crate) tension_range: [f64; 2],
    /// Modulus along and across the lines.
    pub(crate) modulus: [f64; 2],
    /// Axis of the lines, if the scene gives no directions.
    pub(crate) directions: fn() -> MembraneDirections,
    pub(crate) source: &'static str,
}

/// Directions around the head–foot axis.
fn around() -> MembraneDirections {
    MembraneDirections { around: Some([0.0, 0.0, 1.0]), ..MembraneDirections::default() }
}

/// Directions along the head–foot axis.
fn along() -> MembraneDirections {
    MembraneDirections { along: Some([0.0, 0.0, 1.0]), ..MembraneDirections::default() }
}

/// The moduli are chosen within the range that models of living skin use at small strains, 30 to
/// 150 N/m. Excised skin is far stiffer: 1.18 ± 0.88 MPa at the start of the curve and 83 ± 35 MPa
/// later (Ní Annaidh et al., J. Mech. Behav. Biomed. Mater. 5, 2012).
pub(crate) const PRESETS: &[MembranePreset] = &[
    MembranePreset {
        name: "arm",
        tension: [8.0, 3.0],
        tension_range: [5.6, 11.4],
        modulus: [50.0, 30.0],
        directions: along,
        source: "tension: largest values of 6.2, 11.4 and 5.6 N/m in vivo on the arm, Flynn, Taberner, \
                 Nielsen, Biomech. Model. Mechanobiol. 10, 2011; modulus: chosen",
    },
    MembranePreset {
        name: "limb",
        tension: [8.0, 3.0],
        tension_range: [5.6, 11.4],
        modulus: [50.0, 30.0],
        directions: along,
        source: "the values of the arm, Flynn, Taberner, Nielsen 2011; chosen for the leg",
    },
    MembranePreset {
        name: "trunk",
        tension: [15.0, 5.0],
        tension_range: [5.0, 30.0],
        modulus: [60.0, 40.0],
        directions: around,
        source: "chosen between the arm (Flynn, Taberner, Nielsen 2011) and the face (Flynn et al. 2018)",
    },
    MembranePreset {
        name: "head",
        tension: [20.0, 10.0],
        tension_range: [7.0, 106.0],
        modulus: [80.0, 50.0],
        directions: around,
        source: "chosen between the trunk and the cheek, for the neck and the rest of the head",
    },
    MembranePreset {
        name: "cheek",
        tension: [40.0, 20.0],
        tension_range: [7.0, 106.0],
        modulus: [120.0, 80.0],
        directions: around,
        source: "tension: 7 to 53 kPa at a thickness of 1 to 2 mm in vivo on the face, Flynn et al. 2018; \
                 modulus: chosen",
    },
];

/// The preset of a name.
pub(crate) fn preset(name: &str) -> Option<&'static MembranePreset> {
    PRESETS.iter().find(|preset| preset.name == name)
}
