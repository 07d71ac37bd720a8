//! Strokes from the markups of 3D Slicer.
//!
//! The file is read as a stream. Values that are not needed are skipped without being stored, so
//! that the memory stays below a small multiple of the size of the file.

mod values;

use std::fmt;
use std::path::Path;

use nalgebra::Point3;
use serde::Deserialize;
use serde::de::{Deserializer, Error, SeqAccess, Visitor};

use super::text::shortened;
use super::{Place, Polyline, Strokes, too_many};
use crate::SkinError;
use values::{ControlPoints, Scalar, Units};

/// The part of a schema's address that names the version whose keys this module knows.
const SCHEMA: &str = "markups-schema-v1.";

/// The polylines of a file, and warnings about skipped parts. Lists of points count as polylines
/// with `LISTS`.
pub(super) fn parse<const LISTS: bool>(
    path: &Path,
    bytes: &[u8],
) -> Result<(Vec<Polyline>, Vec<String>), SkinError> {
    let document: Document<LISTS> = serde_json::from_slice(bytes).map_err(|error| at_line(path, &error))?;
    if let Some(schema) = document.schema.filter(|schema| !schema.to_lowercase().contains(SCHEMA)) {
        let problem = format!("`@schema` is {:?}; expected an address with {SCHEMA:?}", shortened(&schema));
        return Err(SkinError::StrokeFile { path: path.into(), line: 1, problem });
    }
    let Markups { curves, skipped } = document.markups;
    let points = curves.iter().map(|curve| curve.points_mm.len()).sum::<usize>();
    if points > Strokes::MAX_POINTS {
        return Err(too_many(path, "points", Strokes::MAX_POINTS));
    }
    let polyline = |curve: Curve| Polyline::new(path, Place::Markup(curve.index), curve.points_mm);
    Ok((curves.into_iter().map(polyline).collect::<Result<_, _>>()?, skipped.warnings(LISTS)))
}

/// The error with its line as a number instead of text.
fn at_line(path: &Path, error: &serde_json::Error) -> SkinError {
    let text = error.to_string();
    let place = format!(" at line {} column {}", error.line(), error.column());
    let problem = text.strip_suffix(&place).unwrap_or(&text).to_owned();
    SkinError::StrokeFile { path: path.into(), line: error.line(), problem }
}

/// A file of markups.
#[derive(Deserialize)]
struct Document<const LISTS: bool> {
    #[serde(rename = "@schema")]
    schema: Option<String>,
    markups: Markups<LISTS>,
}

/// The polylines among the markups of a file. With `LISTS` a list of points is one, too.
struct Markups<const LISTS: bool> {
    curves: Vec<Curve>,
    skipped: Skipped,
}

/// The control points of a markup that is a stroke.
struct Curve {
    index: usize,
    points_mm: Vec<Point3<f64>>,
}

/// Counts of the skipped parts.
#[derive(Default)]
struct Skipped {
    markups: usize,
    /// Index and type of the first skipped markup.
    first: Option<(usize, String)>,
    points: usize,
}

impl Skipped {
    fn warnings(self, lists: bool) -> Vec<String> {
        let mut warnings = Vec::new();
        if let Some((index, kind)) = self.first {
            let (what, types) = match lists {
                false => ("strokes", "Curve, ClosedCurve and Line"),
                true => ("paths", "Curve, ClosedCurve, Line and Fiducial"),
            };
            warnings.push(format!(
                "{} markups are not {what} and were skipped, the first is markups[{index}] of the type {:?}; {what} are \
                 of the types {types}",
                self.markups,
                shortened(&kind)
            ));
        }
        if self.points > 0 {
            warnings.push(format!("{} control points have no position and were skipped", self.points));
        }
        warnings
    }
}

/// The keys of a markup that are used.
#[derive(Deserialize)]
struct Markup {
    #[serde(rename = "type")]
    kind: String,
    #[serde(rename = "coordinateSystem")]
    system: Option<Scalar>,
    #[serde(rename = "coordinateUnits")]
    units: Option<Units>,
    #[serde(rename = "controlPoints", default)]
    points: ControlPoints,
}

impl Markup {
    /// The points of the stroke in RAS+, or what is wrong.
    fn points_mm(self, closed: bool) -> Result<Vec<Point3<f64>>, String> {
        if let Some(units) = self.units.filter(|units| !units.are_mm()) {
            return Err(format!("coordinateUnits is {units}; expected \"mm\""));
        }
        let sign = match self.system.as_ref().map(|system| system.0.as_str()) {
            None | Some("LPS" | "1") => -1.0,
            Some("RAS" | "0") => 1.0,
            Some(other) => {
                return Err(format!(
                    "coordinateSystem is {:?}; expected \"LPS\" or \"RAS\"",
                    shortened(other)
                ));
            }
        };
        let to_ras = |[x, y, z]: [f64; 3]| Point3::new(sign * x, sign * y, z);
        let mut points_mm: Vec<Point3<f64>> = self.points.positions.into_iter().map(to_ras).collect();
        if let (true, [first, _, .., last]) = (closed, &points_mm[..])
            && first != last
        {
            points_mm.push(*first);
        }
        Ok(points_mm)
    }
}

impl<'de, const LISTS: bool> Deserialize<'de> for Markups<LISTS> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(MarkupsVisitor)
    }
}

struct MarkupsVisitor<const LISTS: bool>;

impl<'de, const LISTS: bool> Visitor<'de> for MarkupsVisitor<LISTS> {
    type Value = Markups<LISTS>;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("a list of markups")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Markups<LISTS>, A::Error> {
        let mut markups = Markups { curves: Vec::new(), skipped: Skipped::default() };
        for index in 0.. {
            let markup =
                list.next_element::<Markup>().map_err(|error| in_element("markups", index, &error))?;
            let Some(markup) = markup else { break };
            let kind = markup.kind.as_str();
            if !(["Curve", "ClosedCurve", "Line"].contains(&kind) || (LISTS && kind == "Fiducial")) {
                markups.skipped.markups += 1;
                markups.skipped.first.get_or_insert((index, markup.kind));
                continue;
            }
            markups.skipped.points += markup.points.skipped;
            let closed = markup.kind == "ClosedCurve";
            let points_mm =
                markup.points_mm(closed).map_err(|problem| in_element("markups", index, &problem))?;
            markups.curves.push(Curve { index, points_mm });
        }
        Ok(markups)
    }
}

/// An error with the path of the element in which it occurred. A position in the file at the end of
/// the text stays there.
fn in_element<E: Error>(list: &str, index: usize, problem: &dyn fmt::Display) -> E {
    let problem = problem.to_string();
    let separator =
        if problem.starts_with("controlPoints[") || problem.starts_with("coordinate") { "." } else { ": " };
    E::custom(format_args!("{list}[{index}]{separator}{problem}"))
}
