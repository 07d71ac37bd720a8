//! Limits of links, and the table that maps HU to materials.

use serde::{Deserialize, Serialize};

use crate::ChainError;

/// How far the links of an element give way along each axis of the grid, and how much it relaxes.
///
/// Lengths are relative to the rest length of the link. Each end of a link contributes half of its
/// limits. A link between bone and fat therefore stretches half as much as a link within fat, and a
/// link within bone keeps its length exactly.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Shortest length of a link along each axis, from 0 to 1.
    pub shortest: [f64; 3],
    /// Longest length of a link along each axis, from 1 to 16.
    pub longest: [f64; 3],
    /// Largest shear of a link along each axis: how far its ends may move apart across the link, in
    /// either direction. From 0 to 16.
    pub shear: [f64; 3],
    /// Threshold of relaxation in steps, from 0 to 4096. An element moves only if the mean position
    /// that its neighbors ask for is at least this far away in a coordinate. 0 is fully elastic.
    pub k: f64,
}

impl Material {
    /// A material that keeps its shape, such as bone.
    pub const RIGID: Self = Self { shortest: [1.0; 3], longest: [1.0; 3], shear: [0.0; 3], k: 0.0 };

    /// A material with the same limits along every axis.
    pub const fn isotropic(shortest: f64, longest: f64, shear: f64, k: f64) -> Self {
        Self { shortest: [shortest; 3], longest: [longest; 3], shear: [shear; 3], k }
    }

    /// Checks the ranges of all numbers. `place` is the index of the material in its list.
    pub(crate) fn check(&self, place: usize) -> Result<(), ChainError> {
        let wrong = |key, value, range| Err(ChainError::Material { material: place, key, value, range });
        for axis in 0..3 {
            let Self { shortest, longest, shear, .. } = *self;
            if !(0.0..=1.0).contains(&shortest[axis]) {
                return wrong("shortest", shortest[axis], "0 to 1");
            }
            if !(1.0..=16.0).contains(&longest[axis]) {
                return wrong("longest", longest[axis], "1 to 16");
            }
            if !(0.0..=16.0).contains(&shear[axis]) {
                return wrong("shear", shear[axis], "0 to 16");
            }
        }
        if (0.0..=4096.0).contains(&self.k) { Ok(()) } else { wrong("k", self.k, "0 to 4096") }
    }
}

/// Maps Hounsfield units (HU) to materials.
///
/// ```
/// use cutis_chainmail::{Material, MaterialTable};
/// let soft = Material::isotropic(0.6, 1.5, 0.5, 0.1);
/// let table = MaterialTable::new(&[(-449.0, soft), (300.0, Material::RIGID)])?;
/// let numbers = [-1000.0, -449.0, 299.9, 300.0].map(|hu| table.at(hu));
/// assert_eq!(numbers, [None, Some(0), Some(0), Some(1)]);
/// # Ok::<(), cutis_chainmail::ChainError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialTable {
    from_hu: Vec<f32>,
    materials: Vec<Material>,
}

impl MaterialTable {
    /// Creates a table in which each material holds from its HU up to the HU of the next entry.
    /// Below the first entry there is no material.
    ///
    /// # Errors
    /// [`ChainError::MaterialCount`], [`ChainError::TableOrder`], [`ChainError::Material`].
    pub fn new(entries: &[(f32, Material)]) -> Result<Self, ChainError> {
        check_all(entries.iter().map(|(_, material)| material))?;
        let rises = |n: usize| entries[n].0.is_finite() && (n == 0 || entries[n - 1].0 < entries[n].0);
        if let Some(entry) = (0..entries.len()).find(|&n| !rises(n)) {
            return Err(ChainError::TableOrder { entry, from_hu: entries[entry].0 });
        }
        let (from_hu, materials) = entries.iter().copied().unzip();
        Ok(Self { from_hu, materials })
    }

    /// Names of the presets; the first one is the default.
    pub const PRESETS: [&str; 2] = ["tissue", "uniform"];

    /// A preset by name. `tissue` has fat, firmer soft tissue and rigid bone. `uniform` is the
    /// firmer soft tissue everywhere.
    ///
    /// The limits were chosen, not measured: ChainMail has no physical moduli that could be
    /// compared with measurements.
    ///
    /// # Errors
    /// [`ChainError::NoSuchPreset`].
    pub fn preset(name: &str) -> Result<Self, ChainError> {
        match name {
            "tissue" => {
                Self::new(&[(LOWEST_HU, FAT), (SOFT_ABOVE_HU, SOFT), (BONE_ABOVE_HU, Material::RIGID)])
            }
            "uniform" => Self::new(&[(LOWEST_HU, SOFT)]),
            _ => Err(ChainError::NoSuchPreset { name: name.into(), expected: Self::PRESETS.join(" or ") }),
        }
    }

    /// HU at which the first material begins.
    pub fn lowest_hu(&self) -> f32 {
        self.from_hu[0]
    }

    /// The materials in the order of their numbers.
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// Number of the material at an HU. `None` below the first material and for NaN.
    pub fn at(&self, hu: f32) -> Option<u8> {
        let below = self.from_hu.iter().take_while(|&&from| from <= hu).count();
        below.checked_sub(1).map(|place| place as u8)
    }
}

/// The presets begin at air.
const LOWEST_HU: f32 = -1024.0;
/// Water and muscle are above this value; fat (about −100 HU) is below.
const SOFT_ABOVE_HU: f32 = -30.0;
/// Bone is above this value, as in the scenes of this project.
const BONE_ABOVE_HU: f32 = 250.0;
const FAT: Material = Material::isotropic(0.4, 1.8, 0.8, 0.02);
const SOFT: Material = Material::isotropic(0.6, 1.4, 0.6, 0.02);

/// Largest number of materials; there is a table entry for every pair.
pub(crate) const MOST_MATERIALS: usize = 64;

/// Checks the number of materials and each of them.
pub(crate) fn check_all<'a>(
    materials: impl ExactSizeIterator<Item = &'a Material>,
) -> Result<(), ChainError> {
    let count = materials.len();
    if !(1..=MOST_MATERIALS).contains(&count) {
        return Err(ChainError::MaterialCount { count, most: MOST_MATERIALS });
    }
    materials.enumerate().try_for_each(|(place, material)| material.check(place))
}
