//! Slices in order along their normal, and checks of their distances.

use std::path::Path;

use nalgebra::Vector3;

use super::error::DicomError;
use super::slice::Slice;
use crate::{Affine, VolumeError};

/// Distances below this are one position, mm and share of the usual distance.
const SAME_MM: f64 = 0.01;
const SAME_SHARE: f64 = 0.01;
/// A distance that differs more from the usual one is reported.
const WARN_SHARE: f64 = 0.01;
/// A distance that differs more from the usual one makes the slices uneven.
const UNEVEN_SHARE: f64 = 0.1;
/// Slices are tilted if they are shifted against each other by more pixels.
const SHIFT_PIXELS: f64 = 0.1;

/// Slices in order along their normal.
pub(super) struct Stack {
    pub(super) slices: Vec<Slice>,
    /// Position of each slice along the normal, mm from the first.
    pub(super) along_mm: Vec<f64>,
    /// Position of each slice along rows and columns, mm from the first.
    pub(super) shift_mm: Vec<[f64; 2]>,
    gaps: Option<Gaps>,
}

/// Distances of neighboring slices, mm.
struct Gaps {
    least: f64,
    most: f64,
    mean: f64,
    usual: f64,
}

impl Stack {
    /// Sorts the slices. There is at least one.
    ///
    /// # Errors
    /// [`DicomError::SamePosition`] or [`DicomError::MissingSlices`].
    pub(super) fn new(mut slices: Vec<Slice>) -> Result<Self, DicomError> {
        let (first, normal) = (slices[0].position_mm, slices[0].normal());
        let along = |slice: &Slice| (slice.position_mm - first).dot(&normal);
        slices.sort_by(|a, b| along(a).total_cmp(&along(b)).then_with(|| a.source.cmp(&b.source)));
        let (first, [row, column]) = (slices[0].position_mm, slices[0].axes);
        let offset = |slice: &Slice| slice.position_mm - first;
        let along_mm: Vec<f64> = slices.iter().map(|slice| offset(slice).dot(&normal)).collect();
        let shift_mm =
            slices.iter().map(|slice| [offset(slice).dot(&row), offset(slice).dot(&column)]).collect();
        let gaps = Self::gaps(&slices, &along_mm)?;
        Ok(Self { slices, along_mm, shift_mm, gaps })
    }

    fn gaps(slices: &[Slice], along_mm: &[f64]) -> Result<Option<Gaps>, DicomError> {
        let gaps: Vec<f64> = along_mm.windows(2).map(|pair| pair[1] - pair[0]).collect();
        if gaps.is_empty() {
            return Ok(None);
        }
        let mut sorted = gaps.clone();
        sorted.sort_by(f64::total_cmp);
        let usual = sorted[(sorted.len() - 1) / 2];
        let (least, most) = (sorted[0], sorted[sorted.len() - 1]);
        let same = SAME_MM.max(SAME_SHARE * usual);
        if let Some(n) = gaps.iter().position(|&gap| gap <= same) {
            let [first, second] = [n, n + 1].map(|n| slices[n].source.clone());
            return Err(DicomError::SamePosition { first, second, gap_mm: gaps[n] });
        }
        // Most distances are equal, and others are multiples of them: slices of an even series are
        // missing.
        let mostly_equal = usual <= (1.0 + UNEVEN_SHARE) * least;
        let whole = |gap: f64| (gap / least - (gap / least).round()).abs() <= UNEVEN_SHARE;
        let thick = |slice: &Slice| slice.thickness_mm.unwrap_or(0.0);
        let even_thickness = slices.iter().all(|slice| (thick(slice) - thick(&slices[0])).abs() <= 1e-3);
        let double = gaps.iter().position(|&gap| (gap / least).round() >= 2.0);
        if let Some(n) =
            double.filter(|_| mostly_equal && even_thickness && gaps.iter().all(|&gap| whole(gap)))
        {
            return Err(DicomError::MissingSlices {
                before: slices[n].source.clone(),
                after: slices[n + 1].source.clone(),
                gap_mm: gaps[n],
                usual_mm: least,
                count: (gaps[n] / least).round() as u32 - 1,
            });
        }
        let mean = along_mm[along_mm.len() - 1] / gaps.len() as f64;
        Ok(Some(Gaps { least, most, mean, usual }))
    }

    /// Angle between the normal and the line through the first pixels, degrees. 0 if the slices are
    /// not shifted by a tenth of a pixel. The attribute GantryDetectorTilt is not used: it may be
    /// missing, or have either sign.
    pub(super) fn tilt_deg(&self) -> f64 {
        let last = self.slices.len() - 1;
        let [x, y] = self.shift_mm[last];
        if self.is_shifted() { x.hypot(y).atan2(self.along_mm[last]).to_degrees() } else { 0.0 }
    }

    fn is_shifted(&self) -> bool {
        let [dx, dy] = self.slices[0].spacing_mm;
        self.shift_mm.iter().any(|[x, y]| x.abs() > SHIFT_PIXELS * dx || y.abs() > SHIFT_PIXELS * dy)
    }

    /// Checks that the slices are a volume with perpendicular axes. `path` is that of the user.
    ///
    /// # Errors
    /// [`DicomError::Tilted`] or [`DicomError::UnevenSlices`].
    pub(super) fn require_regular(&self, path: &Path, warnings: &mut Vec<String>) -> Result<(), DicomError> {
        if self.is_shifted() {
            return Err(DicomError::Tilted { path: path.into(), tilt_deg: self.tilt_deg() });
        }
        let Some(gaps) = &self.gaps else {
            warnings.push("there is one slice: its thickness is taken as the distance of slices".into());
            return Ok(());
        };
        let off = |usual: f64| (gaps.most - usual).max(usual - gaps.least) / usual;
        if off(gaps.usual) > UNEVEN_SHARE {
            let (least_mm, most_mm) = (gaps.least, gaps.most);
            return Err(DicomError::UnevenSlices { path: path.into(), least_mm, most_mm });
        }
        if off(gaps.mean) > WARN_SHARE {
            let moved =
                self.along_mm.iter().enumerate().map(|(n, along)| (along - n as f64 * gaps.mean).abs());
            warnings.push(format!(
                "the distance of the slices varies from {:.3} to {:.3} mm: their mean of {:.3} mm is used, which moves a \
                 slice by up to {:.3} mm",
                gaps.least,
                gaps.most,
                gaps.mean,
                moved.fold(0.0, f64::max)
            ));
        }
        Ok(())
    }

    /// True if the slices are neither shifted nor uneven.
    pub(super) fn is_regular(&self) -> bool {
        self.require_regular(Path::new(""), &mut Vec::new()).is_ok()
    }

    /// Distance of the slices along their normal, mm: the mean, or the thickness of a single slice.
    pub(super) fn step_mm(&self) -> f64 {
        let thickness = self.slices[0].thickness_mm.unwrap_or(1.0);
        self.gaps.as_ref().map_or(thickness, |gaps| gaps.mean)
    }

    /// Smallest and largest distance, mm.
    pub(super) fn gap_range_mm(&self) -> Option<[f64; 2]> {
        self.gaps.as_ref().map(|gaps| [gaps.least, gaps.most])
    }

    /// The map from voxel index to RAS+ mm, for slices at a distance of `step_mm` whose first pixel
    /// is at `origin_mm` from that of the first slice, along rows, columns and the normal.
    pub(super) fn affine(&self, step_mm: f64, origin_mm: [f64; 3]) -> Result<Affine, VolumeError> {
        let slice = &self.slices[0];
        let [row, column] = slice.axes;
        let axes = [row, column, slice.normal()];
        let origin =
            (0..3).fold(slice.position_mm, |at: Vector3<f64>, axis| at + axes[axis] * origin_mm[axis]);
        let steps = [slice.spacing_mm[0], slice.spacing_mm[1], step_mm];
        // DICOM uses LPS: the first two coordinates have the opposite sign (PS3.3, C.7.6.2.1.1).
        let sign = [-1.0, -1.0, 1.0];
        let line = |r: usize| -> [f64; 4] {
            std::array::from_fn(|c| sign[r] * if c < 3 { axes[c][r] * steps[c] } else { origin[r] })
        };
        Affine::from_rows([line(0), line(1), line(2), [0.0, 0.0, 0.0, 1.0]])
    }
}
