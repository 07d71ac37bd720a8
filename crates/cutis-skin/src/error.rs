//! The crate's error type.

use std::path::PathBuf;

use crate::strokes::Place;

/// Errors of skins, directions, stroke files and depths.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SkinError {
    /// An array does not have one value per lattice point.
    #[error("the array `{array}` has {found} values; expected {expected}, one per lattice point")]
    Length {
        /// Name of the array.
        array: &'static str,
        /// Number of lattice points.
        expected: usize,
        /// Number of values given.
        found: usize,
    },
    /// There is not one normal per skin triangle.
    #[error("{found} normals are given for {expected} skin triangles; expected one for each")]
    Normals {
        /// Number of triangles.
        expected: usize,
        /// Number of normals given.
        found: usize,
    },
    /// A HU value of a vertex of the body is NaN or infinite.
    #[error("the HU value at lattice point {point:?} is {hu}; it must be finite at a vertex of the body")]
    Hu {
        /// Lattice point `(i, j, k)`.
        point: [usize; 3],
        /// The HU value.
        hu: f32,
    },
    /// A triangle is not a face of a lattice tetrahedron.
    #[error(
        "skin triangle {triangle} joins the lattice points {points:?} of {count}; it must join three corners of one \
         lattice cell"
    )]
    Triangle {
        /// Number of the triangle, from 0.
        triangle: usize,
        /// Its corners as flat lattice indices.
        points: [u32; 3],
        /// Number of lattice points.
        count: usize,
    },
    /// An axis has no direction.
    #[error("the axis of `{key}` is {axis:?}; it must be finite and not zero")]
    Axis {
        /// `around` or `along`.
        key: &'static str,
        /// The given axis.
        axis: [f64; 3],
    },
    /// A distance in mm is not positive.
    #[error("`{key}` is {value}; it must be {expected}")]
    Distance {
        /// Name of the distance.
        key: &'static str,
        /// The given distance in mm.
        value: f64,
        /// The valid distances.
        expected: &'static str,
    },
    /// A file of strokes could not be read.
    #[error("cannot read {path}: {source}")]
    StrokeRead {
        /// Path of the file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// A file of strokes is too large.
    #[error("{path} has more than {most} {unit}; a file of strokes has at most that many")]
    StrokeFileSize {
        /// Path of the file.
        path: PathBuf,
        /// `bytes` or `points`.
        unit: &'static str,
        /// Largest number.
        most: usize,
    },
    /// A line of a file of strokes is not valid.
    #[error("{path}, line {line}: {problem}")]
    StrokeFile {
        /// Path of the file.
        path: PathBuf,
        /// Number of the line, from 1.
        line: usize,
        /// The wrong value, its place in a JSON file, and what is valid.
        problem: String,
    },
    /// A file has no stroke.
    #[error("{path} has no stroke: expected {expected}")]
    NoStroke {
        /// Path of the file.
        path: PathBuf,
        /// What makes a stroke in this format.
        expected: &'static str,
    },
    /// A file for one path has several.
    #[error(
        "{path} has {count} paths, the first two are {} and {}; a cut needs a file with one",
        places[0],
        places[1]
    )]
    SeveralPaths {
        /// Path of the file.
        path: PathBuf,
        /// Number of paths.
        count: usize,
        /// Places of the first two.
        places: [Place; 2],
    },
    /// The points of a path are no pairs.
    #[error(
        "{path}, {place}: the path has {points} points; a file of pairs needs lines, or a list with an even number of points"
    )]
    OddPoints {
        /// Path of the file.
        path: PathBuf,
        /// Place of the path.
        place: Place,
        /// Number of points.
        points: usize,
    },
    /// A file of one pair has more.
    #[error("{path} has {count} pairs of points; a handle needs a file with one, such as a line")]
    SeveralPairs {
        /// Path of the file.
        path: PathBuf,
        /// Number of pairs.
        count: usize,
    },
    /// A stroke has fewer than two points, or all of its points are equal.
    #[error(
        "{path}, {place}: the stroke has {points} points and is {length_mm} mm long; it needs two points that differ"
    )]
    StrokeTooShort {
        /// Path of the file.
        path: PathBuf,
        /// Place of the stroke in the file.
        place: Place,
        /// Number of points.
        points: usize,
        /// Length in mm.
        length_mm: f64,
    },
    /// A coordinate of a stroke is NaN or infinite.
    #[error("{path}, {place}: point {point} of the stroke is {at_mm:?} mm; coordinates must be finite")]
    StrokePoint {
        /// Path of the file.
        path: PathBuf,
        /// Place of the stroke in the file.
        place: Place,
        /// Number of the point in the stroke, from 0.
        point: usize,
        /// The point in mm.
        at_mm: [f64; 3],
    },
    /// A stroke is too far from the skin.
    #[error(
        "{path}, {place}: after point {point}, at {at_mm:.1?} mm, the stroke is {distance_mm:.1} mm from the skin; it must \
         lie within {reach_mm:.1} mm of it"
    )]
    StrokeOffSkin {
        /// Path of the file.
        path: PathBuf,
        /// Place of the stroke in the file.
        place: Place,
        /// Number of the last point of the stroke, from 0, at or before this position.
        point: usize,
        /// The position on the stroke in mm.
        at_mm: [f64; 3],
        /// Distance in mm to the nearest vertex of the skin. Infinite if there is no skin.
        distance_mm: f64,
        /// Largest allowed distance in mm.
        reach_mm: f64,
    },
    /// A stroke pierces the skin instead of running along it.
    #[error(
        "{path}, {place}: the stroke pierces the skin instead of running along it: on average the squared sine of its \
         angle to the normal is {along:.2}; it must be at least {least}"
    )]
    StrokeThroughSkin {
        /// Path of the file.
        path: PathBuf,
        /// Place of the stroke in the file.
        place: Place,
        /// Mean of the squared sine of the angle between the stroke and the normal of the skin.
        along: f64,
        /// Smallest allowed mean.
        least: f64,
    },
    /// The strokes are too long for the lattice.
    #[error(
        "{path}: the strokes are {length_mm:.0} mm long; on this lattice they may be at most {most_mm:.0} mm long"
    )]
    StrokesTooLong {
        /// Path of the file.
        path: PathBuf,
        /// Length of all strokes in mm.
        length_mm: f64,
        /// Largest allowed length in mm.
        most_mm: f64,
    },
}
