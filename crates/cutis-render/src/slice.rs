//! Axial, coronal and sagittal slices in the planes of the patient.

use cutis_volume::Volume;
use nalgebra::Point3;
use rayon::prelude::*;

use crate::annotate::{annotate, extent, frame};
use crate::contour::Contour;
use crate::field::Field;
use crate::image::to_byte;
use crate::view::Focus;
use crate::{Axes, Image, RenderError, Side};

/// HU of air.
const AIR_HU: f32 = -1000.0;

/// A plane of the patient.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plane {
    /// Across the body. Its position increases towards superior.
    Axial,
    /// Parallel to the chest. Its position increases towards anterior.
    Coronal,
    /// From front to back. Its position increases towards the patient's right.
    Sagittal,
}

/// Position and appearance of a slice.
#[derive(Clone, Copy, Debug)]
pub struct SliceView<'a> {
    /// Orientation of the slice.
    pub plane: Plane,
    /// Position of the slice along its normal, world mm.
    pub at_mm: f64,
    /// True (default): the patient's right is on the left of the picture. False: mirrored.
    pub radiological: bool,
    /// Width of the gray scale, HU. Default 400.
    pub window_hu: f32,
    /// Center of the gray scale, HU. Default 40.
    pub level_hu: f32,
    /// Gray at the low end of the window, 0 to below 1. HU between there and air (−1000 HU, black)
    /// get the grays below it, so that a voxel that is partly air shows how much. With 0 (default)
    /// all HU below the window are black: an edge between tissue and air appears inside the tissue,
    /// and where it is cut by voxels, as stairs.
    pub edge_gray: f32,
    /// Pixels along the longer side. With `None` a pixel has the finest voxel spacing.
    pub long_side: Option<usize>,
    /// The part to show; with `None` the whole slice.
    pub focus: Option<Focus>,
    /// Surfaces whose intersection is drawn as lines.
    pub contours: &'a [Contour<'a>],
    /// True to draw orientation letters and a scale bar.
    pub annotate: bool,
}

impl SliceView<'_> {
    /// Default settings: the whole slice with the finest voxel spacing per pixel, window 400, level
    /// 40, radiological.
    pub fn new(plane: Plane, at_mm: f64) -> Self {
        Self {
            plane,
            at_mm,
            radiological: true,
            window_hu: 400.0,
            level_hu: 40.0,
            edge_gray: 0.0,
            long_side: None,
            focus: None,
            contours: &[],
            annotate: true,
        }
    }

    fn axes(&self) -> Result<Axes, RenderError> {
        Axes::new(match (self.plane, self.radiological) {
            (Plane::Axial, true) => Side::Inferior,
            (Plane::Axial, false) => Side::Superior,
            (Plane::Coronal, true) => Side::Anterior,
            (Plane::Coronal, false) => Side::Posterior,
            (Plane::Sagittal, true) => Side::Left,
            (Plane::Sagittal, false) => Side::Right,
        })
    }

    fn validate(&self) -> Result<(), RenderError> {
        let bad = |key, value, expected| Err(RenderError::Setting { key, value, expected });
        if !self.at_mm.is_finite() {
            return bad("at_mm", self.at_mm, "finite");
        }
        if !(self.window_hu.is_finite() && self.window_hu > 0.0) {
            return bad("window_hu", self.window_hu.into(), "a width above zero");
        }
        if !self.level_hu.is_finite() {
            return bad("level_hu", self.level_hu.into(), "finite");
        }
        if !(0.0..1.0).contains(&self.edge_gray) {
            return bad("edge_gray", self.edge_gray.into(), "0 to below 1");
        }
        if let Some(focus) = &self.focus {
            focus.validate()?;
        }
        self.contours.iter().enumerate().try_for_each(|(number, contour)| contour.validate(number))
    }

    /// Gray level of an HU value: black up to `level − window/2`, white from `level + window/2`,
    /// and linear in between (DICOM PS3.3 C.11.2.1.3.2, LINEAR_EXACT). With `edge_gray` the window
    /// begins at that gray, and below it the gray falls to black at −1000 HU.
    pub fn gray(&self, hu: f32) -> u8 {
        let low = self.level_hu - self.window_hu / 2.0;
        let part = ((hu - low) / self.window_hu).clamp(0.0, 1.0);
        let below = if low > AIR_HU { ((hu - AIR_HU) / (low - AIR_HU)).clamp(0.0, 1.0) } else { 1.0 };
        to_byte((self.edge_gray * below + (1.0 - self.edge_gray) * part) * 255.0)
    }
}

/// Draws a slice.
///
/// The volume is resampled to the plane of the patient, so that oblique volumes appear upright and
/// anisotropic voxels keep their aspect ratio. The picture is black outside the volume.
///
/// # Errors
/// [`RenderError::ImageSize`], [`RenderError::Setting`], [`RenderError::VertexOutOfRange`].
pub fn slice(volume: &Volume, view: &SliceView<'_>) -> Result<Image, RenderError> {
    view.validate()?;
    let field = Field::new(volume);
    let axes = view.axes()?;
    let corners = field.corners_mm();
    let [width_mm, height_mm] = match view.focus {
        Some(focus) => [focus.size_mm; 2],
        None => [axes.right, axes.up].map(|axis| extent(&corners, &axis)),
    };
    let pixel = view.long_side.map_or(field.finest_mm(), |long| width_mm.max(height_mm) / long as f64);
    let [width, height] = [width_mm, height_mm].map(|length| (length / pixel).round().max(1.0) as usize);
    let mut image = Image::new(width, height, [0; 3])?;
    let (mut center, _) = frame(&axes, &corners, view.focus, [width, height]);
    let axis = match view.plane {
        Plane::Axial => 2,
        Plane::Coronal => 1,
        Plane::Sagittal => 0,
    };
    center[axis] = view.at_mm;

    let shape = field.shape();
    image.rgb.par_chunks_mut(3 * width).enumerate().for_each(|(y, row)| {
        let v = (height as f64 - 1.0) / 2.0 - y as f64;
        for (x, out) in row.chunks_exact_mut(3).enumerate() {
            let u = x as f64 - (width as f64 - 1.0) / 2.0;
            let index = field.to_index(center + (axes.right * u + axes.up * v) * pixel);
            let inside = (0..3).all(|axis| index[axis] >= -0.5 && index[axis] <= shape[axis] as f64 - 0.5);
            if inside {
                out.fill(view.gray(field.at(index)));
            }
        }
    });

    let thickness = (width.max(height) as f64 / 400.0).max(1.0);
    for contour in view.contours {
        for segment in contour.cut(center, &axes.toward) {
            let [from, to] = segment.map(|p: Point3<f64>| {
                let from_center = (p - center) / pixel;
                let u = from_center.dot(&axes.right) + (width as f64 - 1.0) / 2.0;
                [u, (height as f64 - 1.0) / 2.0 - from_center.dot(&axes.up)]
            });
            image.line(from, to, thickness, contour.color);
        }
    }
    if view.annotate {
        annotate(&mut image, &axes, pixel);
    }
    Ok(image)
}
