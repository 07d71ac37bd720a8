//! One path that was drawn on the skin, for a cut.

use std::path::Path;

use nalgebra::Point3;

use super::{bytes_of, polylines, too_many};
use crate::SkinError;

/// One path from a file. Positions are RAS+ millimeters.
///
/// ```
/// use cutis_skin::DrawnPath;
/// let text = br#"{"markups": [{"type": "Curve", "coordinateSystem": "LPS", "controlPoints": [
///     {"position": [30, -100, 0]}, {"position": [0, -105, 0]}, {"position": [-30, -100, 0]}]}]}"#;
/// let path = DrawnPath::parse("cut.mrk.json", text)?;
/// assert_eq!(path.points_mm()[0], [-30.0, 100.0, 0.0].into());
/// # Ok::<(), cutis_skin::SkinError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnPath {
    points_mm: Vec<Point3<f64>>,
    warnings: Vec<String>,
}

impl DrawnPath {
    /// Largest number of points of a path.
    pub const MAX_POINTS: usize = 1000;

    /// Reads the path from a file in one of the formats of [`Strokes::read`](super::Strokes::read).
    /// In markups of 3D Slicer a list of points (type `Fiducial`) is a path, too. It runs from
    /// point to point.
    ///
    /// # Errors
    /// The errors of [`Strokes::read`](super::Strokes::read). [`SkinError::SeveralPaths`] if the
    /// file has more than one path. [`SkinError::StrokeFileSize`] for more than
    /// [`DrawnPath::MAX_POINTS`] points.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, SkinError> {
        let path = path.as_ref();
        Self::parse(path, &bytes_of(path)?)
    }

    /// Reads the path from the bytes of a file. `path` names it in messages.
    ///
    /// # Errors
    /// The errors of [`DrawnPath::read`].
    pub fn parse(path: impl AsRef<Path>, bytes: &[u8]) -> Result<Self, SkinError> {
        let path = path.as_ref();
        let (polylines, warnings) = polylines::<true>(path, bytes)?;
        match &polylines[..] {
            [one] if one.points_mm().len() > Self::MAX_POINTS => {
                Err(too_many(path, "points", Self::MAX_POINTS))
            }
            [one] => Ok(Self { points_mm: one.points_mm().to_vec(), warnings }),
            several => Err(SkinError::SeveralPaths {
                path: path.into(),
                count: several.len(),
                places: [several[0].place(), several[1].place()],
            }),
        }
    }

    /// The points, at least two. A closed curve has the first one again at the end.
    pub fn points_mm(&self) -> &[Point3<f64>] {
        &self.points_mm
    }

    /// What was skipped in the file.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }
}
