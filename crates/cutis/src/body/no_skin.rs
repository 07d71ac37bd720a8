//! Why a CT has no skin, as an error that says what to change.

use cutis_mesh::SkinReport;
use cutis_volume::Volume;
use rayon::prelude::*;

use super::AIR_BELOW_HU;

/// HU that only bone, contrast agent and metal reach. In a CT whose air is 0, all soft tissue does.
const DENSE_HU: f32 = 600.0;
/// Share of the voxels that are dense if the CT has an offset. In HU a scan has a few percent.
const DENSE_SHARE: f64 = 0.1;
/// Values below this one are padding around the scan, not air.
const PADDING_HU: f32 = -1100.0;

/// The reason why no skin was found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoSkin {
    /// The values are not HU: they were stored with an offset and without an intercept.
    #[error(
        "no value lies between {PADDING_HU} and {air_below_hu} HU, so nothing is air, and {:.0} % of the values \
         are {DENSE_HU} HU or more, as only bone is: the CT was stored with an offset and without an intercept. \
         Its lowest value is {lowest_hu}{}: set {key} = {advice_hu}, so that air is about -1000 HU and water 0",
        100.0 * dense_share,
        if *has_padding { " without the padding around the scan" } else { "" }
    )]
    Offset {
        /// HU below which a value is air.
        air_below_hu: f32,
        /// Lowest value above the padding.
        lowest_hu: f32,
        /// Whether some values are padding.
        has_padding: bool,
        /// Share of the values that are dense.
        dense_share: f64,
        /// What to set.
        key: &'static str,
        /// The value that makes the lowest value air.
        advice_hu: f32,
    },
    /// No value is air, although the values may be HU.
    #[error(
        "nothing is air: all values are from {lowest_hu} to {highest_hu} HU, and air is below {air_below_hu} HU. \
         There is no skin if the scan ends inside the body, or if the air around it was replaced by another \
         value: use a CT with the air around the body"
    )]
    AllTissue {
        /// Lowest value.
        lowest_hu: f32,
        /// Highest value.
        highest_hu: f32,
        /// HU below which a value is air.
        air_below_hu: f32,
    },
    /// All values are air.
    #[error(
        "everything is air: all values are from {lowest_hu} to {highest_hu} HU, and tissue is {air_below_hu} HU \
         and more; check that the file is a CT in HU"
    )]
    AllAir {
        /// Lowest value.
        lowest_hu: f32,
        /// Highest value.
        highest_hu: f32,
        /// HU below which a value is air.
        air_below_hu: f32,
    },
    /// Tissue and air exist, but no tetrahedron is all tissue.
    #[error(
        "no tissue is thick enough: none of the {tets} tetrahedra of the lattice has four tissue corners; \
         use a finer lattice"
    )]
    TooThin {
        /// Number of tetrahedra of the lattice.
        tets: usize,
    },
    /// The body reaches the sides of the scan everywhere, so that no outside air touches it.
    #[error(
        "the air in the scan is enclosed by the body: tissue reaches all sides of the scan, so no skin is in it; \
         use a CT that shows the skin and air around it"
    )]
    Enclosed,
}

/// Lowest and highest value of a CT, and what its values are.
#[derive(Clone, Copy, Debug)]
struct Values {
    lowest: f32,
    highest: f32,
    /// Lowest value that is not padding.
    lowest_inside: f32,
    /// Number of values that are not padding.
    inside: usize,
    air: usize,
    dense: usize,
}

impl Values {
    fn of(volume: &Volume, air_below_hu: f32) -> Self {
        let none = Self {
            lowest: f32::INFINITY,
            highest: f32::NEG_INFINITY,
            lowest_inside: f32::INFINITY,
            inside: 0,
            air: 0,
            dense: 0,
        };
        let add = |values: Self, &stored: &i16| {
            let hu = volume.hu(stored);
            let inside = hu >= PADDING_HU;
            Self {
                lowest: values.lowest.min(hu),
                highest: values.highest.max(hu),
                lowest_inside: if inside { values.lowest_inside.min(hu) } else { values.lowest_inside },
                inside: values.inside + usize::from(inside),
                air: values.air + usize::from(inside && hu < air_below_hu),
                dense: values.dense + usize::from(hu >= DENSE_HU),
            }
        };
        let join = |a: Self, b: Self| Self {
            lowest: a.lowest.min(b.lowest),
            highest: a.highest.max(b.highest),
            lowest_inside: a.lowest_inside.min(b.lowest_inside),
            inside: a.inside + b.inside,
            air: a.air + b.air,
            dense: a.dense + b.dense,
        };
        volume.voxels().par_chunks(1 << 16).map(|part| part.iter().fold(none, add)).reduce(|| none, join)
    }
}

/// Refuses a CT whose values are not HU because of an offset. `key` is what sets the offset.
pub(super) fn refuse_offset(volume: &Volume, air_below_hu: f32, key: &'static str) -> Result<(), NoSkin> {
    let values = Values::of(volume, air_below_hu);
    let dense_share = values.dense as f64 / values.inside.max(1) as f64;
    if values.air > 0 || dense_share < DENSE_SHARE {
        return Ok(());
    }
    let lowest_hu = values.lowest_inside;
    // Offsets in use put air at 0, and some at a value that pixels cannot be below.
    let advice_hu = if lowest_hu.abs() < 500.0 { -1024.0 } else { (-1000.0 - lowest_hu).round() };
    let has_padding = values.lowest < PADDING_HU;
    Err(NoSkin::Offset { air_below_hu, lowest_hu, has_padding, dense_share, key, advice_hu })
}

/// Warning about a CT whose values are not HU because of an offset.
pub(crate) fn offset_warning(volume: &Volume) -> Option<String> {
    refuse_offset(volume, AIR_BELOW_HU, "volume.offset_hu")
        .err()
        .map(|why| format!("there is no skin: {why}"))
}

/// Why a CT has no skin. `report` is that of its skin, without triangles.
pub(super) fn reason(volume: &Volume, air_below_hu: f32, report: &SkinReport) -> NoSkin {
    let Values { lowest: lowest_hu, highest: highest_hu, .. } = Values::of(volume, air_below_hu);
    if lowest_hu >= air_below_hu {
        return NoSkin::AllTissue { lowest_hu, highest_hu, air_below_hu };
    }
    if highest_hu < air_below_hu {
        return NoSkin::AllAir { lowest_hu, highest_hu, air_below_hu };
    }
    match report.air_vertex_histogram[0] {
        0 => NoSkin::TooThin { tets: report.tets },
        _ => NoSkin::Enclosed,
    }
}
