//! Values in the markups of 3D Slicer, read without storing more than is needed.

use std::fmt;

use serde::Deserialize;
use serde::de::{Deserializer, Error, IgnoredAny, SeqAccess, Visitor};

use super::super::text::shortened;
use super::in_element;

/// A text, or a number as text.
pub(super) struct Scalar(pub String);

impl<'de> Deserialize<'de> for Scalar {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ScalarVisitor)
    }
}

struct ScalarVisitor;

impl Visitor<'_> for ScalarVisitor {
    type Value = Scalar;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("the name of a coordinate system")
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Scalar, E> {
        Ok(Scalar(text.to_owned()))
    }

    fn visit_u64<E: Error>(self, number: u64) -> Result<Scalar, E> {
        Ok(Scalar(number.to_string()))
    }
}

/// A unit: its code in UCUM, or a list of the code, the coding scheme and a meaning.
#[derive(Default)]
pub(super) struct Units {
    code: String,
    scheme: Option<String>,
}

impl Units {
    pub fn are_mm(&self) -> bool {
        self.code == "mm" && self.scheme.as_ref().is_none_or(|scheme| scheme == "UCUM")
    }
}

impl fmt::Display for Units {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{:?}", shortened(&self.code))?;
        self.scheme.as_ref().map_or(Ok(()), |scheme| write!(out, " of {:?}", shortened(scheme)))
    }
}

impl<'de> Deserialize<'de> for Units {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(UnitsVisitor)
    }
}

struct UnitsVisitor;

impl<'de> Visitor<'de> for UnitsVisitor {
    type Value = Units;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("a unit such as \"mm\"")
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Units, E> {
        Ok(Units { code: text.to_owned(), scheme: None })
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Units, A::Error> {
        let code = list.next_element()?.unwrap_or_default();
        let scheme = list.next_element()?.unwrap_or_default();
        while list.next_element::<IgnoredAny>()?.is_some() {}
        Ok(Units { code, scheme: Some(scheme) })
    }
}

/// The positions of the control points that have one, and the number of the others.
#[derive(Default)]
pub(super) struct ControlPoints {
    pub positions: Vec<[f64; 3]>,
    pub skipped: usize,
}

/// The keys of a control point that are used.
#[derive(Deserialize)]
struct ControlPoint {
    #[serde(default)]
    position: Position,
    #[serde(rename = "positionStatus")]
    status: Option<String>,
}

impl ControlPoint {
    /// The position. `None` if the point has not been placed.
    fn position(self) -> Result<Option<[f64; 3]>, String> {
        match (self.status.as_deref(), self.position) {
            (Some("undefined" | "preview"), _) => Ok(None),
            (None | Some("defined"), Position::Numbers(position, 3)) => Ok(Some(position)),
            (None | Some("defined"), wrong) => Err(format!("position {wrong}; expected three numbers in mm")),
            (Some(other), _) => Err(format!(
                "positionStatus is {:?}; expected \"defined\", \"undefined\" or \"preview\"",
                shortened(other)
            )),
        }
    }
}

impl<'de> Deserialize<'de> for ControlPoints {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(ControlPointsVisitor)
    }
}

struct ControlPointsVisitor;

impl<'de> Visitor<'de> for ControlPointsVisitor {
    type Value = ControlPoints;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("a list of control points")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<ControlPoints, A::Error> {
        let mut points = ControlPoints::default();
        for index in 0.. {
            let wrong = |problem: &dyn fmt::Display| in_element("controlPoints", index, problem);
            let point = list.next_element::<ControlPoint>().map_err(|error| wrong(&error))?;
            let Some(point) = point else { break };
            match point.position().map_err(|problem| wrong(&problem))? {
                Some(position) => points.positions.push(position),
                None => points.skipped += 1,
            }
        }
        Ok(points)
    }
}

/// The value of `position`. Slicer writes an empty text for a point that is not placed.
#[derive(Default)]
enum Position {
    #[default]
    Missing,
    Text,
    /// The first three numbers, and how many there are.
    Numbers([f64; 3], usize),
}

impl fmt::Display for Position {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Missing => out.write_str("is missing"),
            Self::Text => out.write_str("is a text"),
            Self::Numbers(_, count) => write!(out, "has {count} numbers"),
        }
    }
}

impl<'de> Deserialize<'de> for Position {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(PositionVisitor)
    }
}

struct PositionVisitor;

impl<'de> Visitor<'de> for PositionVisitor {
    type Value = Position;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("a position of three numbers in mm")
    }

    fn visit_unit<E: Error>(self) -> Result<Position, E> {
        Ok(Position::Missing)
    }

    fn visit_str<E: Error>(self, _: &str) -> Result<Position, E> {
        Ok(Position::Text)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Position, A::Error> {
        let mut numbers = [0.0; 3];
        let mut count = 0;
        while let Some(number) = list.next_element::<f64>()? {
            if let Some(place) = numbers.get_mut(count) {
                *place = number;
            }
            count += 1;
        }
        Ok(Position::Numbers(numbers, count))
    }
}
