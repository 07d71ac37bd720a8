//! Errors of DICOM series. They never show names, dates or identifiers of a patient.

use std::fmt;
use std::path::PathBuf;

/// A slice: its file, and the frame of a file with several.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct SliceSource {
    /// Path of the file.
    pub path: PathBuf,
    /// Number of the frame from 1, if the file has several slices.
    pub frame: Option<u32>,
}

impl fmt::Display for SliceSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        self.frame.map_or(Ok(()), |frame| write!(f, " (frame {frame})"))
    }
}

/// Why DICOM files are not a CT volume.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DicomError {
    /// The file cannot be parsed.
    #[error("{path} is not a readable DICOM file: {reason}")]
    Damaged {
        /// Path of the file.
        path: PathBuf,
        /// What is wrong.
        reason: &'static str,
    },
    /// The folder has more files than a scan.
    #[error("{path} has more than {most} files: name the folder of one series")]
    TooManyFiles {
        /// Path given by the user.
        path: PathBuf,
        /// Largest number of files.
        most: usize,
    },
    /// There is no image of a CT series.
    #[error("{path} has no CT series: {found}")]
    NoSeries {
        /// Path given by the user.
        path: PathBuf,
        /// What was found instead.
        found: String,
    },
    /// There are several series.
    #[error("{path} has {} series; choose one with volume.series = NUMBER in a scene, --series NUMBER on the command line, or the path of one of its files:\n{}", series.len(), series.join("\n"))]
    SeveralSeries {
        /// Path given by the user.
        path: PathBuf,
        /// One line for each series.
        series: Vec<String>,
    },
    /// No series has the requested number.
    #[error("{path} has no series with the number {number}; it has:\n{}", series.join("\n"))]
    NoSuchSeries {
        /// Path given by the user.
        path: PathBuf,
        /// The requested number.
        number: u32,
        /// One line for each series.
        series: Vec<String>,
    },
    /// Several series have the requested number.
    #[error("{path} has {} series with the number {number}; name one of its files as the path, such as:\n{}", series.len(), series.join("\n"))]
    AmbiguousSeries {
        /// Path given by the user.
        path: PathBuf,
        /// The requested number.
        number: u32,
        /// One line for each of these series, and its first file.
        series: Vec<String>,
    },
    /// A needed attribute is missing.
    #[error("{slice}: the attribute {tag} is missing: expected {expected}")]
    Missing {
        /// The slice.
        slice: SliceSource,
        /// Keyword of the attribute.
        tag: &'static str,
        /// The valid values.
        expected: &'static str,
    },
    /// An attribute has an invalid value.
    #[error("{slice}: the attribute {tag} is {value}: expected {expected}")]
    Invalid {
        /// The slice.
        slice: SliceSource,
        /// Keyword of the attribute.
        tag: &'static str,
        /// The value found.
        value: String,
        /// The valid values.
        expected: &'static str,
    },
    /// The file is of a kind that is not read.
    #[error("{path}: {what} is not read: {remedy}")]
    Unsupported {
        /// Path of the file.
        path: PathBuf,
        /// The kind.
        what: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// The pixels use a compression that is not read.
    #[error("{path}: pixels in {syntax} are not read: {remedy}")]
    Compression {
        /// Path of the file.
        path: PathBuf,
        /// Name and UID of the transfer syntax.
        syntax: String,
        /// What to do.
        remedy: &'static str,
    },
    /// The pixel data are not what the header says, or the decoder fails.
    #[error("{slice}: the pixels cannot be decoded: {reason}")]
    Pixels {
        /// The slice.
        slice: SliceSource,
        /// What is wrong.
        reason: &'static str,
    },
    /// Two slices are at the same position.
    #[error(
        "{first} and {second} are slices at the same position ({gap_mm:.3} mm apart): a volume needs one slice per position; \
         move the files of the other scan, or the copies, to another folder"
    )]
    SamePosition {
        /// The one slice.
        first: SliceSource,
        /// The other slice.
        second: SliceSource,
        /// Distance along the normal of the slices, mm.
        gap_mm: f64,
    },
    /// Slices are missing.
    #[error(
        "{count} slice{} seem{} to be missing between {before} and {after}: they are {gap_mm:.3} mm apart, and other slices \
         {usual_mm:.3} mm; copy the missing files to the folder",
        if *count == 1 { "" } else { "s" }, if *count == 1 { "s" } else { "" }
    )]
    MissingSlices {
        /// The slice before the gap.
        before: SliceSource,
        /// The slice after the gap.
        after: SliceSource,
        /// Distance along the normal of the slices, mm.
        gap_mm: f64,
        /// Distance of other slices, mm.
        usual_mm: f64,
        /// Number of slices that would fill the gap.
        count: u32,
    },
    /// The distance of the slices varies.
    #[error(
        "{path}: the distance of the slices varies from {least_mm:.3} to {most_mm:.3} mm: volume.resample = true in a scene, \
         or --resample on the command line, resamples them to equal distances"
    )]
    UnevenSlices {
        /// Path given by the user.
        path: PathBuf,
        /// Smallest distance, mm.
        least_mm: f64,
        /// Largest distance, mm.
        most_mm: f64,
    },
    /// The slices are shifted against each other, as with a tilted gantry.
    #[error(
        "{path}: the slices are tilted by {tilt_deg:.1} degrees against the direction in which they are stacked (gantry tilt): \
         volume.resample = true in a scene, or --resample on the command line, resamples them to perpendicular axes"
    )]
    Tilted {
        /// Path given by the user.
        path: PathBuf,
        /// Angle between the normal of the slices and the line through their corners, degrees.
        tilt_deg: f64,
    },
}
