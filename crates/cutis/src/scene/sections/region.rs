//! `lattice.region`: the part of the body that is simulated.

use std::fmt;

use schemars::JsonSchema;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use super::body::Zone;

/// The part of the body that is simulated: `"whole"`, or a zone.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum RegionSection {
    /// The whole body.
    Whole(WholeBody),
    /// A zone.
    Zone(RegionZone),
}

/// The whole body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub enum WholeBody {
    /// The whole body.
    #[serde(rename = "whole")]
    Whole,
}

/// The part of the body that is simulated: `around_mm`, or a box.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RegionZone {
    /// Everything within this distance of an incision or a handle, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub around_mm: Option<f64>,
    /// Lowest corner of the box, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub min_mm: Option<[f64; 3]>,
    /// Highest corner of the box, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_mm: Option<[f64; 3]>,
    /// Why the program picked this zone; none if the scene names it.
    #[serde(skip)]
    pub picked: Option<PickedRegion>,
}

/// What the program knows about a region that it picked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PickedRegion {
    /// Size of the wounds, mm.
    pub wound_mm: f64,
    /// Estimate of how much less the wounds open than in the whole body, as a part of the opening.
    pub error: f64,
}

impl RegionSection {
    /// Everything within a distance of an incision or a handle, mm.
    pub fn around(mm: f64) -> Self {
        Self::Zone(RegionZone { around_mm: Some(mm), ..RegionZone::default() })
    }

    pub(crate) fn zone(&self) -> Option<Zone> {
        match self {
            Self::Whole(_) => None,
            Self::Zone(zone) => Zone::of(zone.around_mm, zone.min_mm, zone.max_mm),
        }
    }

    /// What is known about the region if the program picked it.
    pub fn picked(&self) -> Option<PickedRegion> {
        match self {
            Self::Whole(_) => None,
            Self::Zone(zone) => zone.picked,
        }
    }
}

impl<'de> Deserialize<'de> for RegionSection {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Either)
    }
}

struct Either;

impl<'de> Visitor<'de> for Either {
    type Value = RegionSection;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("\"whole\", or a zone such as { around_mm = 60.0 }")
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<Self::Value, E> {
        match name {
            "whole" => Ok(RegionSection::Whole(WholeBody::Whole)),
            other => Err(E::invalid_value(serde::de::Unexpected::Str(other), &self)),
        }
    }

    fn visit_map<M: MapAccess<'de>>(self, map: M) -> Result<Self::Value, M::Error> {
        RegionZone::deserialize(MapAccessDeserializer::new(map)).map(RegionSection::Zone)
    }
}
