//! The text format of strokes: one point per line, empty lines between strokes.

use std::path::Path;

use nalgebra::Point3;

use super::{Place, Polyline, Strokes, too_many};
use crate::SkinError;

/// Names of the columns that the first line may have.
const HEADERS: [[&str; 3]; 2] = [["x", "y", "z"], ["x_mm", "y_mm", "z_mm"]];

/// The strokes of a file.
pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<Vec<Polyline>, SkinError> {
    let mut reader = Reader { path, polylines: Vec::new(), points: Vec::new(), first_line: 0, total: 0 };
    let mut may_be_header = true;
    for (index, line) in bytes.split(|&byte| byte == b'\n').enumerate() {
        let number = index + 1;
        let wrong = |problem| SkinError::StrokeFile { path: path.into(), line: number, problem };
        let line = std::str::from_utf8(line).map_err(|_| wrong("is not UTF-8 text".into()))?.trim();
        let content = line.split('#').next().unwrap_or_default().trim_end();
        if line.is_empty() {
            reader.end_stroke()?;
        } else if !content.is_empty() {
            if !(may_be_header && is_header(content)) {
                reader.add(number, point(content).map_err(wrong)?)?;
            }
            may_be_header = false;
        }
    }
    reader.end_stroke()?;
    Ok(reader.polylines)
}

fn is_header(content: &str) -> bool {
    HEADERS.iter().any(|names| content.split_whitespace().eq(*names))
}

/// The strokes of the lines so far.
struct Reader<'a> {
    path: &'a Path,
    polylines: Vec<Polyline>,
    /// The points of the stroke that has not ended, and the line of the first of them.
    points: Vec<Point3<f64>>,
    first_line: usize,
    /// Number of points of all strokes.
    total: usize,
}

impl Reader<'_> {
    fn add(&mut self, line: usize, point: Point3<f64>) -> Result<(), SkinError> {
        if self.points.is_empty() {
            self.first_line = line;
        }
        self.points.push(point);
        self.total += 1;
        match self.total > Strokes::MAX_POINTS {
            true => Err(too_many(self.path, "points", Strokes::MAX_POINTS)),
            false => Ok(()),
        }
    }

    fn end_stroke(&mut self) -> Result<(), SkinError> {
        if !self.points.is_empty() {
            let points = std::mem::take(&mut self.points);
            self.polylines.push(Polyline::new(self.path, Place::Line(self.first_line), points)?);
        }
        Ok(())
    }
}

/// The three coordinates of a line, or what is wrong with it.
fn point(content: &str) -> Result<Point3<f64>, String> {
    let mut point = Point3::origin();
    let mut count = 0;
    for word in content.split_whitespace() {
        if count < 3 {
            let number = word.parse::<f64>().ok().filter(|number| number.is_finite());
            point[count] = number.ok_or_else(|| {
                format!("{:?} is not a finite number; expected the coordinates x y z in mm", shortened(word))
            })?;
        }
        count += 1;
    }
    match count {
        3 => Ok(point),
        _ => Err(format!("there are {count} numbers; expected the coordinates x y z in mm")),
    }
}

/// The first characters of a text, for messages.
pub(super) fn shortened(text: &str) -> String {
    const MOST: usize = 40;
    let mut short: String = text.chars().take(MOST).collect();
    if text.chars().nth(MOST).is_some() {
        short.push('…');
    }
    short
}
