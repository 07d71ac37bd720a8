//! Strokes: polylines on the skin that show the direction of its tension, and their files.

mod drawn_pairs;
mod drawn_path;
mod markups;
mod text;

use std::fmt;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use nalgebra::Point3;

use crate::SkinError;

pub use drawn_pairs::DrawnPairs;
pub use drawn_path::DrawnPath;

/// Strokes on the skin, from a file or from a program. Positions are RAS+ millimeters.
///
/// ```
/// use cutis_skin::Strokes;
/// let text = b"# two strokes\n0 0 0\n10 0 0\n20 5 0\n\n0 30 0\n10 30 0\n";
/// let strokes = Strokes::parse("langer.txt", text)?;
/// assert_eq!((strokes.polylines().len(), strokes.polylines()[0].points_mm().len()), (2, 3));
/// assert!(Strokes::parse("langer.txt", b"0 0 0\n10 zero 0\n").is_err());
/// # Ok::<(), cutis_skin::SkinError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Strokes {
    path: PathBuf,
    polylines: Vec<Polyline>,
    warnings: Vec<String>,
    reach_mm: Option<f64>,
}

/// One stroke: at least two points that are finite and not all equal.
#[derive(Clone, Debug, PartialEq)]
pub struct Polyline {
    place: Place,
    points_mm: Vec<Point3<f64>>,
}

/// Place of a stroke in its file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Number of the line with its first point, from 1.
    Line(usize),
    /// Index in the array `markups` of a file of 3D Slicer, from 0.
    Markup(usize),
    /// Number of the stroke in the list of a program, from 0.
    Number(usize),
}

impl fmt::Display for Place {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(out, "line {line}"),
            Self::Markup(index) => write!(out, "markups[{index}]"),
            Self::Number(number) => write!(out, "stroke {number}"),
        }
    }
}

impl Polyline {
    fn new(path: &Path, place: Place, points_mm: Vec<Point3<f64>>) -> Result<Self, SkinError> {
        if let Some(point) = points_mm.iter().position(|at| !at.iter().all(|c| c.is_finite())) {
            let at_mm = points_mm[point].into();
            return Err(SkinError::StrokePoint { path: path.into(), place, point, at_mm });
        }
        let polyline = Self { place, points_mm };
        let (points, length_mm) = (polyline.points_mm.len(), polyline.length_mm());
        if length_mm > 0.0 {
            return Ok(polyline);
        }
        Err(SkinError::StrokeTooShort { path: path.into(), place, points, length_mm })
    }

    /// Place in the file.
    pub fn place(&self) -> Place {
        self.place
    }

    /// The points in RAS+ mm. The first point of a closed curve occurs again at its end.
    pub fn points_mm(&self) -> &[Point3<f64>] {
        &self.points_mm
    }

    /// Length in mm.
    pub fn length_mm(&self) -> f64 {
        self.points_mm.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum()
    }
}

impl Strokes {
    /// Largest size of a file in bytes.
    pub const MAX_BYTES: usize = 64 << 20;

    /// Largest number of points in a file.
    pub const MAX_POINTS: usize = 1_000_000;

    /// Reads strokes from a file. The content decides about the format.
    ///
    /// **Markups of 3D Slicer** (`.mrk.json`) begin with `{`. Each `Curve`, `ClosedCurve` and
    /// `Line` of the array `markups` is a stroke through its control points. Other markups and
    /// control points without a position are skipped with a warning. `coordinateSystem` is `LPS`
    /// (the default) or `RAS`, or the numbers 1 and 0 of old files. `coordinateUnits` must be `mm`.
    /// The file does not say how Slicer interpolates a curve between its control points, so that
    /// the stroke is straight between them. Source: the schema `markups-schema-v1.0.3.json` and
    /// `vtkMRMLMarkupsJsonStorageNode` of 3D Slicer.
    ///
    /// **Text** has one point `x y z` per line, in RAS+ mm. Empty lines separate strokes. `#`
    /// begins a comment, and lines with only a comment are ignored. The first line may be the
    /// header `x y z`.
    ///
    /// # Errors
    /// [`SkinError::StrokeRead`] if the file cannot be read. The errors of [`Strokes::parse`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self, SkinError> {
        let path = path.as_ref();
        Self::parse(path, &bytes_of(path)?)
    }

    /// Reads strokes from the bytes of a file. `path` names it in messages.
    ///
    /// # Errors
    /// [`SkinError::StrokeFileSize`] for more than [`Strokes::MAX_BYTES`] bytes or
    /// [`Strokes::MAX_POINTS`] points. [`SkinError::StrokeFile`] if a line, key or value is not
    /// valid. [`SkinError::StrokePoint`] for coordinates that are not finite.
    /// [`SkinError::StrokeTooShort`] for a stroke without two different points.
    /// [`SkinError::NoStroke`] if there is no stroke.
    pub fn parse(path: impl AsRef<Path>, bytes: &[u8]) -> Result<Self, SkinError> {
        let path = path.as_ref();
        let (polylines, warnings) = polylines::<false>(path, bytes)?;
        Ok(Self { path: path.into(), polylines, warnings, reach_mm: None })
    }

    /// Takes strokes from a program: lists of points in RAS+ mm. `name` stands for the path in
    /// messages.
    ///
    /// # Errors
    /// [`SkinError::StrokePoint`] for coordinates that are not finite.
    /// [`SkinError::StrokeTooShort`] for a stroke without two different points.
    /// [`SkinError::NoStroke`] if the list is empty.
    pub fn from_points(name: &str, strokes: &[Vec<[f64; 3]>]) -> Result<Self, SkinError> {
        let path = PathBuf::from(name);
        let polyline = |(number, points): (usize, &Vec<[f64; 3]>)| {
            let points_mm = points.iter().copied().map(Point3::from).collect();
            Polyline::new(&path, Place::Number(number), points_mm)
        };
        let polylines: Vec<Polyline> = strokes.iter().enumerate().map(polyline).collect::<Result<_, _>>()?;
        if polylines.is_empty() {
            return Err(SkinError::NoStroke { path, expected: "at least one list of points" });
        }
        Ok(Self { path, polylines, warnings: Vec::new(), reach_mm: None })
    }

    /// Sets how far from the skin a stroke may be, in mm. The default is three times the longest
    /// distance between neighboring planes of the lattice.
    ///
    /// # Errors
    /// [`SkinError::Distance`] if the distance is not above 0, or infinite.
    pub fn with_reach_mm(self, reach_mm: f64) -> Result<Self, SkinError> {
        if !(reach_mm > 0.0 && reach_mm.is_finite()) {
            return Err(SkinError::Distance {
                key: "reach_mm",
                value: reach_mm,
                expected: "finite and above 0",
            });
        }
        Ok(Self { reach_mm: Some(reach_mm), ..self })
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The strokes, in the order of the file.
    pub fn polylines(&self) -> &[Polyline] {
        &self.polylines
    }

    /// What was skipped in the file.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    pub(crate) fn reach_mm(&self) -> Option<f64> {
        self.reach_mm
    }
}

/// The bytes of a file, at most one more than [`Strokes::MAX_BYTES`].
fn bytes_of(path: &Path) -> Result<Vec<u8>, SkinError> {
    let failed = |source| SkinError::StrokeRead { path: path.into(), source };
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(failed)?;
    file.take(Strokes::MAX_BYTES as u64 + 1).read_to_end(&mut bytes).map_err(failed)?;
    Ok(bytes)
}

/// One or more polylines of a file of either format, and what was skipped. Lists of points count as
/// polylines with `LISTS`.
fn polylines<const LISTS: bool>(
    path: &Path,
    bytes: &[u8],
) -> Result<(Vec<Polyline>, Vec<String>), SkinError> {
    if bytes.len() > Strokes::MAX_BYTES {
        return Err(too_many(path, "bytes", Strokes::MAX_BYTES));
    }
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let first = bytes.iter().find(|byte| !byte.is_ascii_whitespace());
    let (polylines, warnings, expected) = if first == Some(&b'{') {
        let (polylines, warnings) = markups::parse::<LISTS>(path, bytes)?;
        let expected = match LISTS {
            false => "a markup of the type Curve, ClosedCurve or Line",
            true => "a markup of the type Curve, ClosedCurve, Line or Fiducial",
        };
        (polylines, warnings, expected)
    } else {
        (text::parse(path, bytes)?, Vec::new(), "lines with the coordinates x y z in mm")
    };
    match polylines.is_empty() {
        true => Err(SkinError::NoStroke { path: path.into(), expected }),
        false => Ok((polylines, warnings)),
    }
}

fn too_many(path: &Path, unit: &'static str, most: usize) -> SkinError {
    SkinError::StrokeFileSize { path: path.into(), unit, most }
}
