//! Pairs of points that were drawn on the skin, for stitches and handles.

use std::path::Path;

use nalgebra::Point3;

use super::{DrawnPath, bytes_of, polylines, too_many};
use crate::SkinError;

/// Pairs of points from a file. Positions are RAS+ millimeters.
///
/// ```
/// use cutis_skin::DrawnPairs;
/// let text = br#"{"markups": [{"type": "Line", "coordinateSystem": "LPS", "controlPoints": [
///     {"position": [5, -100, 0]}, {"position": [-5, -100, 0]}]}]}"#;
/// let pairs = DrawnPairs::parse("stitch.mrk.json", text)?;
/// assert_eq!(pairs.one()?[1], [5.0, 100.0, 0.0].into());
/// # Ok::<(), cutis_skin::SkinError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnPairs {
    path: std::path::PathBuf,
    pairs_mm: Vec<[Point3<f64>; 2]>,
    warnings: Vec<String>,
}

impl DrawnPairs {
    /// Reads pairs from a file in one of the formats of [`Strokes::read`](super::Strokes::read). A
    /// markup of the type `Line` is a pair. In a list of points (type `Fiducial`), and in a path,
    /// the first two points are a pair, the next two are another one, and so on.
    ///
    /// # Errors
    /// The errors of [`Strokes::read`](super::Strokes::read). [`SkinError::OddPoints`] for a path
    /// with an odd number of points. [`SkinError::StrokeFileSize`] for more than
    /// [`DrawnPath::MAX_POINTS`] points.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, SkinError> {
        let path = path.as_ref();
        Self::parse(path, &bytes_of(path)?)
    }

    /// Reads the pairs from the bytes of a file. `path` names it in messages.
    ///
    /// # Errors
    /// The errors of [`DrawnPairs::read`].
    pub fn parse(path: impl AsRef<Path>, bytes: &[u8]) -> Result<Self, SkinError> {
        let path = path.as_ref();
        let (polylines, warnings) = polylines::<true>(path, bytes)?;
        let mut pairs_mm = Vec::new();
        for polyline in &polylines {
            let (pairs, rest) = polyline.points_mm().as_chunks::<2>();
            if !rest.is_empty() {
                let points = polyline.points_mm().len();
                return Err(SkinError::OddPoints { path: path.into(), place: polyline.place(), points });
            }
            pairs_mm.extend(pairs);
            if 2 * pairs_mm.len() > DrawnPath::MAX_POINTS {
                return Err(too_many(path, "points", DrawnPath::MAX_POINTS));
            }
        }
        Ok(Self { path: path.into(), pairs_mm, warnings })
    }

    /// The pairs, at least one.
    pub fn pairs_mm(&self) -> &[[Point3<f64>; 2]] {
        &self.pairs_mm
    }

    /// The only pair.
    ///
    /// # Errors
    /// [`SkinError::SeveralPairs`] if there are more.
    pub fn one(&self) -> Result<[Point3<f64>; 2], SkinError> {
        match self.pairs_mm[..] {
            [only] => Ok(only),
            _ => Err(SkinError::SeveralPairs { path: self.path.clone(), count: self.pairs_mm.len() }),
        }
    }

    /// What was skipped in the file.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }
}
